"""What ``--help`` says of a command beyond its options: groups, examples; and nothing of flags' types."""

from collections.abc import Sequence

from graspbench.cli.arguments import group_names


def use_plain_flags() -> None:
    """Let help print no ``<bool>`` beside what takes no value."""
    from typer.core import TyperOption

    typed = TyperOption.display_type_rich
    TyperOption.display_type_rich = lambda self, ctx: None if self.is_flag else typed(self, ctx)  # type: ignore[method-assign]


def epilog(command: str, examples: Sequence[str]) -> str:
    """Return the end of a command's help: the configuration's groups, and examples.

    Args:
        command: Its name.
        examples: What may follow the command, quoted for a shell.
    """
    lines = [f"[bold]Groups[/bold] (group=option): {', '.join(group_names())}", "[bold]Examples[/bold]"]
    lines += [f"graspbench {command} {example}".replace("[", r"\[") for example in examples]
    return "\n\n".join([*lines, "'graspbench config --reference' explains every option."])
