"""``graspbench config``: the composed configuration, nothing run."""

import yaml

from graspbench.cli.arguments import ConfigDir, Json, Overrides


def config(overrides: Overrides = None, as_json: Json = False, config_dir: ConfigDir = None) -> None:
    """Print the configuration that a trial with these overrides would have."""
    from graspbench.cli.printing import print_json
    from graspbench.experiment import load_config

    tree = load_config(overrides or [], config_dir).as_tree()
    if as_json:
        print_json(tree)
    else:
        print(yaml.safe_dump(tree, sort_keys=False, allow_unicode=True), end="")
