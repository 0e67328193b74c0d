"""``graspbench config``: the composed configuration, nothing run."""

from typing import Annotated

import typer

from graspbench.cli.arguments import ConfigDir, Json, Overrides


def config(
    overrides: Overrides = None,
    reference: Annotated[
        bool, typer.Option("--reference", help="Print every option there is, with its meaning, as Markdown.")
    ] = False,
    columns: Annotated[
        bool, typer.Option("--columns", help="Print what each column of trials.csv means, as Markdown.")
    ] = False,
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Print the configuration that a trial with these overrides would have."""
    if reference:
        from graspbench.config.reference import configuration_reference

        print(configuration_reference(), end="")
        return
    if columns:
        from graspbench.results.columns import columns_reference

        print(columns_reference(), end="")
        return
    import yaml

    from graspbench.cli.printing import print_json
    from graspbench.experiment import load_config

    tree = load_config(overrides or [], config_dir).as_tree()
    if as_json:
        print_json(tree)
    else:
        print(yaml.safe_dump(tree, sort_keys=False, allow_unicode=True), end="")
