"""``vibsim completion``: scripts that let a shell complete commands, options and names, and the words they offer.

The scripts contain no lists: they call ``vibsim completion words -- WORD ...`` for the candidates of the last word.
Where this prints none, the shell completes file names.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterable, Sequence
from importlib import import_module
from itertools import chain

BASH = """\
# in ~/.bashrc: source <(vibsim completion bash)
_vibsim() {
    local IFS=$'\\n'
    COMPREPLY=($("${COMP_WORDS[0]}" completion words -- "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null))
}
complete -o default -F _vibsim vibsim
"""
ZSH = """\
# in ~/.zshrc, after compinit: source <(vibsim completion zsh)
_vibsim() {
    local -a found
    found=("${(@f)$("${words[1]}" completion words -- "${(@)words[2,CURRENT]}" 2>/dev/null)}")
    if [[ -n "${found[1]}" ]]; then compadd -a found; else _files; fi
}
compdef _vibsim vibsim
"""
FISH = """\
# vibsim completion fish > ~/.config/fish/completions/vibsim.fish
function __vibsim_words
    set -l before (commandline -opc)
    $before[1] completion words -- $before[2..-1] (commandline -ct) 2>/dev/null
end
complete -c vibsim -a '(__vibsim_words)'
"""
SCRIPTS = {"bash": BASH, "zsh": ZSH, "fish": FISH}
WORDS = "words"
_NAMES = {
    "REASON": ("vibsim.core.vocabulary", "REASONS"),
    **dict.fromkeys(("model", "models"), ("vibsim.models", "MODELS")),
    **dict.fromkeys(("scheme", "schemes"), ("vibsim.schemes", "SCHEMES")),
}
"""Module and attribute with the valid names of an option or a positional argument, by its name or metavar."""


def completion(options: Namespace) -> int:
    """Print the script for a shell, or the candidates for the last word of a command line."""
    if options.shell == WORDS:
        for word in candidates(options.words or [""]):
            print(word)
    else:
        print(SCRIPTS[options.shell], end="")
    return 0


def candidates(words: Sequence[str]) -> list[str]:
    """Return the candidates for the last of the words after ``vibsim``, which may be incomplete or empty."""
    *before, prefix = words
    return sorted({word for word in _offered(before, prefix) if word.startswith(prefix)})


def _offered(before: Sequence[str], prefix: str) -> Iterable[str]:
    from vibsim.cli.arguments import commands

    known = {name: rows for name, _, _, rows in commands()}
    if not before:
        return [*known, "--help", "--version"]
    command, *arguments = before
    if command not in known:
        return []
    rows = known[command]
    slots = [(names[0], settings) for names, settings in rows if not names[0].startswith("-")]
    options = {name: settings for names, settings in rows for name in names if name[0] == "-"}
    last = options.get(arguments[-1], {}) if arguments else {}
    if "metavar" in last or "choices" in last:
        return _values(last, arguments[-1].lstrip("-"), arguments)
    if prefix.startswith("-"):
        return [*options, "--help"]
    positional = _positional(arguments, options)
    if not slots:
        return []
    name, settings = slots[min(len(positional), len(slots) - 1)]
    if len(positional) >= len(slots) and settings.get("nargs") not in ("+", "*"):
        return []
    return _values(settings, name, positional)


def _positional(words: Sequence[str], options: dict[str, dict[str, object]]) -> list[str]:
    """Return the words that are neither options nor values of options."""
    positional, is_value = [], False
    for word in words:
        if word.startswith("-"):
            row = options.get(word, {})
            is_value = "metavar" in row or "choices" in row
        elif is_value:
            is_value = False
        else:
            positional.append(word)
    return positional


def _values(settings: dict[str, object], name: str, before: Sequence[str]) -> Iterable[str]:
    """Return the values of an option or a positional argument: its choices, or the valid names."""
    choices = settings.get("choices")
    if isinstance(choices, Iterable):
        return [str(choice) for choice in choices]
    metavar = str(settings.get("metavar"))
    # the argument before NAME says which list the name is from
    kind = before[0] if name == "name" and before else name
    if metavar in ("EXPERIMENT", "A", "B") or name in ("experiments", "like"):
        return _experiments()
    module, names = _NAMES.get(metavar) or _NAMES.get(kind, ("", ""))
    return list(getattr(import_module(module), names)) if module else []


def _experiments() -> list[str]:
    """Return the names of collections and experiments, without reading them."""
    from vibsim.core.home import home
    from vibsim.plan.choose import experiments

    names = ((choice.collection, choice.name, choice.key) for choice in experiments(home()))
    return list(dict.fromkeys(chain.from_iterable(names)))
