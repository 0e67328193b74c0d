"""The log of a trial: one MCAP file, written while the trial runs, readable even when it was cut.

Names are imported on first use, so that reading the configuration does not load the log's libraries.
"""

from typing import TYPE_CHECKING

from graspbench.lazy import loads_on_use
from graspbench.record.parameters import Level, RecordParameters

if TYPE_CHECKING:
    from graspbench.record.channels import CHANNELS
    from graspbench.record.mcap_log import TrialLog
    from graspbench.record.recover import LogInfo, log_info, recover_log

__all__ = ["CHANNELS", "Level", "LogInfo", "RecordParameters", "TrialLog", "log_info", "recover_log"]

_HOMES = {
    "CHANNELS": "channels",
    "LogInfo": "recover",
    "TrialLog": "mcap_log",
    "log_info": "recover",
    "recover_log": "recover",
}

__getattr__ = loads_on_use(__name__, _HOMES)
