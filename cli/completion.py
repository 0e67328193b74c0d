"""Completion in bash and zsh for words that hold ``=``, ``:`` and commas.

Bash breaks words at ``=`` and ``:``, and replaces only what stands behind the last one. Neither shell should
put a space behind a key that a value is to follow. Typer's own scripts know nothing of that; fish does, and
has Typer's.
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


ZSH: Final = r"""#compdef %(prog_name)s

%(complete_func)s() {
    local line value shown
    local -a keys keys_shown values values_shown
    for line in "${(@f)$(_TYPER_COMPLETE_ARGS="${words[1,$CURRENT]}" _TYPER_COMPLETE_FISH_ACTION=get-args \
            %(autocomplete_var)s=complete_fish %(prog_name)s)}"; do
        [[ -n $line ]] || continue
        value=${line%%%%$'\t'*}
        shown=$value
        [[ $line == *$'\t'?* ]] && shown="$value  -- ${line#*$'\t'}"
        if [[ $value == *[=.] ]]; then
            keys+=("$value") keys_shown+=("$shown")
        else
            values+=("$value") values_shown+=("$shown")
        fi
    done
    (( $#keys )) && compadd -S '' -d keys_shown -a keys
    (( $#values )) && compadd -d values_shown -a values
    (( $#keys + $#values )) || _files
}

compdef %(complete_func)s %(prog_name)s
"""


def use_own_scripts() -> None:
    """Let ``--install-completion`` and ``--show-completion`` give these scripts for bash and zsh."""
    from typer import _completion_shared

    _completion_shared._completion_scripts |= {"bash": BASH, "zsh": ZSH}
