"""Completion in bash for words that hold ``=``, ``:`` and commas.

Bash breaks words at ``=`` and ``:``, and replaces only what stands behind the last one; Typer's own script
knows nothing of that. The scripts for zsh and fish are Typer's.
"""

from typing import Final

BASH: Final = r"""
%(complete_func)s() {
    local line=${COMP_LINE:0:COMP_POINT} word cut at
    local -a words
    word=${line##*[[:space:]]}
    cut=${word%%"${word##*[=:]}"}
    read -ra words <<< "$line"
    at=${#words[@]}
    [[ -n $word ]] && at=$((at - 1))
    local IFS=$'\n'
    COMPREPLY=( $(COMP_WORDS="$line" COMP_CWORD=$at %(autocomplete_var)s=complete_bash "$1") )
    COMPREPLY=( "${COMPREPLY[@]#"$cut"}" )
    [[ ${COMPREPLY[0]} == *[=.] ]] && compopt -o nospace
    return 0
}

complete -o default -F %(complete_func)s %(prog_name)s
"""


def use_own_bash_script() -> None:
    """Let ``--install-completion`` and ``--show-completion`` give this script for bash."""
    from typer import _completion_shared

    _completion_shared._completion_scripts["bash"] = BASH
