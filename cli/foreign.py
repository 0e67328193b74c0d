"""Options of Hydra's own command line, answered with the word that does it here."""

from collections.abc import Sequence

from graspbench.errors import ConfigurationError

_COMMANDS = ("run", "manipulate", "sweep", "config")
_HERE = {
    "--multirun": "'graspbench sweep' runs a grid",
    "--cfg": "'graspbench config' prints what would be run",
    "--info": "'graspbench config' prints what would be run",
    "--resolve": "'graspbench config' prints every value resolved",
    "--package": "'graspbench config' prints every section",
    "--run": "'graspbench run' runs one trial",
    "--config-name": "experiment=NAME chooses a file of options",
    "--config-path": "--config-dir names your folder of options",
    "--experimental-rerun": "'graspbench run --config TRIAL' repeats a stored trial",
    "--hydra-help": "'graspbench config --reference' explains every option",
}
_SHORT = {
    "-c": "--cfg",
    "-m": "--multirun",
    "-cn": "--config-name",
    "-cp": "--config-path",
    "-cd": "--config-path",
}


def refuse_hydras_options(arguments: Sequence[str]) -> None:
    """Refuse what only Hydra's own programs take.

    Args:
        arguments: The words after ``graspbench``.

    Raises:
        ConfigurationError: An option of Hydra's is among them.
    """
    if not arguments or arguments[0] not in _COMMANDS:
        return
    for word in arguments[1:]:
        option = word.partition("=")[0]
        remedy = _HERE.get(_SHORT.get(option, option))
        if remedy is not None:
            raise ConfigurationError(f"'{option}' is an option of Hydra's own programs", remedy=remedy)
