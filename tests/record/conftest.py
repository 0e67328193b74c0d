from tests.made_up_trial import trial

__all__ = ["trial"]
