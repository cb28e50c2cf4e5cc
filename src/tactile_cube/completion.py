"""Completion in bash of `python -m tactile_cube.<command> ...`; Hydra itself completes scripts only, not modules.

`eval "$(python -m tactile_cube.train -sc install=bash)"` switches it on for all commands.
"""

import os
import re

SCRIPT = r"""
_tactile_cube_complete() {
    local words=($COMP_LINE) word=""
    [[ "$COMP_LINE" == *" " ]] || word="${words[-1]}"
    [[ "${words[1]}" == "-m" && "${words[2]}" == tactile_cube.* ]] || return
    local choices=$(COMP_LINE="$COMP_LINE" "${words[0]}" -m "${words[2]}" -sc query=bash 2> /dev/null)
    COMPREPLY=($(compgen -W "$choices" -- "$word"))
}
COMP_WORDBREAKS=${COMP_WORDBREAKS//=}
complete -o nospace -o default -F _tactile_cube_complete python python3
"""


def install_script(arguments: list[str]) -> str | None:
    """What `-sc install=bash` prints, or None if the arguments ask for something else."""
    asked = len(arguments) == 2 and arguments[0] in ("-sc", "--shell-completion") and arguments[1] == "install=bash"
    return SCRIPT if asked else None


def prepare_query() -> None:
    """Make the line to complete look to Hydra as if the command were an executable."""
    line = os.environ.get("COMP_LINE")
    if line:
        os.environ["COMP_LINE"] = re.sub(r"^\S+ -m (tactile_cube\.\w+)", r"\1", line)
