"""The log of a trial: one MCAP file, written while the trial runs, readable even when it was cut."""

from graspbench.record.channels import CHANNELS
from graspbench.record.mcap_log import TrialLog
from graspbench.record.parameters import Level, RecordParameters
from graspbench.record.recover import LogInfo, log_info, recover_log

__all__ = ["CHANNELS", "Level", "LogInfo", "RecordParameters", "TrialLog", "log_info", "recover_log"]
