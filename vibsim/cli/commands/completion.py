"""``vibsim completion``: what a shell needs to complete commands, options and names, and what it may offer.

The scripts hold no list: they ask ``vibsim completion words -- WORD ...`` for what may stand at the last word. What is
none of ours is left to the shell, which completes files.
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
# in ~/.zshrc, behind compinit: source <(vibsim completion zsh)
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
    "checks": ("vibsim.experiment.value_names", "VALUES"),
}
"""Where the names stand that an option or a place may hold, by what it is called."""


def completion(options: Namespace) -> int:
    """Print the script of a shell, or the words that may stand at the end of a command line."""
    if options.shell == WORDS:
        for word in candidates(options.words or [""]):
            print(word)
    else:
        print(SCRIPTS[options.shell], end="")
    return 0


def candidates(words: Sequence[str]) -> list[str]:
    """Return what may stand at the place of the last of some words behind ``vibsim``; it may be begun, or empty."""
    *before, begun = words
    return sorted({word for word in _offered(before, begun) if word.startswith(begun)})


def _offered(before: Sequence[str], begun: str) -> Iterable[str]:
    from vibsim.cli.arguments import commands

    known = {name: rows for name, _, _, rows in commands()}
    if not before:
        return [*known, "--help", "--version"]
    command, *others = before
    if command not in known:
        return []
    rows = [((n,) if isinstance(n, str) else n, settings) for n, settings in known[command]]
    places = [(names[0], settings) for names, settings in rows if not names[0].startswith("-")]
    options = {name: settings for names, settings in rows for name in names if name[0] == "-"}
    last = options.get(others[-1], {}) if others else {}
    if "metavar" in last or "choices" in last:
        return _of(last, others[-1].lstrip("-"), others)
    if begun.startswith("-"):
        return [*options, "--help"]
    given = _positional(others, options)
    if not places:
        return []
    place = places[min(len(given), len(places) - 1)]
    if len(given) >= len(places) and place[1].get("nargs") not in ("+", "*"):
        return []
    return _of(place[1], place[0], given)


def _positional(words: Sequence[str], options: dict[str, dict[str, object]]) -> list[str]:
    """Return the words that are neither options nor their values."""
    found, is_value = [], False
    for word in words:
        if word.startswith("-"):
            row = options.get(word, {})
            is_value = "metavar" in row or "choices" in row
        elif is_value:
            is_value = False
        else:
            found.append(word)
    return found


def _of(settings: dict[str, object], name: str, given: Sequence[str]) -> Iterable[str]:
    """Return the words of an option or a place: its choices, or the names that it may hold."""
    choices = settings.get("choices")
    if isinstance(choices, Iterable):
        return [str(choice) for choice in choices]
    metavar = str(settings.get("metavar"))
    # an entry of a list is named behind the list
    what = given[0] if name == "name" and given else name
    if metavar in ("EXPERIMENT", "A", "B") or what in ("experiments", "like"):
        return _experiments()
    module, names = _NAMES.get(metavar) or _NAMES.get(what, ("", ""))
    return list(getattr(import_module(module), names)) if module else []


def _experiments() -> list[str]:
    """Return the names of collections and experiments, without reading them."""
    from vibsim.core.home import home
    from vibsim.plan.choose import experiments

    names = ((choice.collection, choice.name, choice.key) for choice in experiments(home()))
    return list(dict.fromkeys(chain.from_iterable(names)))
