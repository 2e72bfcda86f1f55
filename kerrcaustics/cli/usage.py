"""Errors of usage of the command line, as one line that names the argument and what it must be."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import cyclopts

from kerrcaustics.choices import either, number_suggestion, suggestion

_WORDS = {int: "a whole number", float: "a number", bool: "true or false"}


def usage_message(error: cyclopts.CycloptsError) -> str:
    """Line about an error of the parser."""
    error.verbose = False
    lines = (line_about(error) for kind, line_about in _LINES.items() if isinstance(error, kind))
    return next(filter(None, lines), " ".join(str(error).split()))


def _command(error: cyclopts.CycloptsError) -> str:
    return " ".join(["kerrcaustics", *(error.command_chain or ())])


def _unknown_command(error: Any) -> str:
    names = [name for name in error.app if not name.startswith("-")]
    word = error.unused_tokens[0]
    # An option may be meant: help, --verson.
    return f"Argument COMMAND must be one of {', '.join(sorted(names))}, but is {word}{suggestion(word, error.app)}"


def _unknown_option(error: Any) -> str:
    words = _unknown_options(error) or [(error.token.keyword or error.token.value).partition("=")[0]]
    return _unknown_and_missing(error, words, _missing(error))


def _unknown_and_missing(error: cyclopts.CycloptsError, unknown: list[str], missing: list[str]) -> str:
    """Line about options that the command does not have, and arguments that it lacks."""
    names = [name for one in _arguments(error) for name in _names(one)]
    meant = {word: suggestion(word, names) for word in unknown}
    # Misspelt, it is not missing.
    missing = [name for name in missing if not any(end.endswith(f" {name}?") for end in meant.values())]
    lines = [f"{_listed([word])} is unknown{end}" for word, end in meant.items() if end != "."]
    strange = [word for word, end in meant.items() if end == "."]
    parts = [f"{_listed(strange)} {'is' if len(strange) == 1 else 'are'} unknown"] if strange else []
    parts += [f"{_listed(missing)} must be given"] if missing else []
    if parts:
        more = f"; {_command(error)} --help lists all options." if strange else "."
        lines.append(", and a".join([parts[0], *(part[1:] for part in parts[1:])]) + more)
    return " ".join(lines)


def _listed(names: list[str]) -> str:
    """Names of arguments, as the subject of a sentence."""
    return f"Argument{'s' * (len(names) > 1)} " + " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _unknown_options(error: cyclopts.CycloptsError) -> list[str]:
    """The options on the command line that the command does not have, also those with one hyphen, or none and a "="."""
    words = []
    for token in error.root_input_tokens or ():
        word, sign, _ = token.partition("=")
        without = sign and not word.startswith("-") and not _is_unknown(error, f"--{word}")
        if without or (word.startswith("-") and len(word) > 2 and not _is_number(word)):
            words.append(word)
    return [word for word in dict.fromkeys(words) if _is_unknown(error, word)]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _missing(error: cyclopts.CycloptsError) -> list[str]:
    """The options that must be given and are not."""
    given = {token.partition("=")[0] for token in error.root_input_tokens or ()}
    return [_name(one) for one in _arguments(error) if one.required and one.names and _is_absent(one, given)]


def _is_absent(argument: Any, given: set[str]) -> bool:
    return argument.name.startswith("-") and given.isdisjoint(argument.names)


def _no_value(error: Any) -> str:
    """Line about a missing value, or about all arguments that are missing."""
    argument = error.argument
    name = _name(argument)
    options = [token for token in error.root_input_tokens or () if token in argument.names]
    if error.tokens_so_far:
        given = " ".join(error.tokens_so_far)
        end = number_suggestion(given, _count(argument)) if _takes_numbers(argument) else "."
        return f"Argument {name} must be {_values(argument)}, but is {given}{end}"
    if options:
        return f"Argument {options[-1]} must be followed by {_values(argument)}."
    missing = list(dict.fromkeys([name, *_missing(error)]))
    return _unknown_and_missing(error, _unknown_options(error), missing)


def _is_unknown(error: cyclopts.CycloptsError, token: str) -> bool:
    return all(token.partition("=")[0] not in _names(one) for one in _arguments(error))


def _too_many(error: Any) -> str:
    """Line about tokens that follow an option that has its values, or that no argument takes."""
    tokens, extra = list(error.root_input_tokens or ()), error.unused_tokens[0]
    before = tokens[: tokens.index(extra)] if extra in tokens else []
    place = next((i for i in reversed(range(len(before))) if before[i].startswith("--")), None)
    option = None if place is None else next((a for a in _arguments(error) if before[place] in a.names), None)
    if place is None or option is None or _takes_text(option) or not _count(option) or not before[place + 1 :]:
        return f"Argument {extra} must be left out: {_command(error)} has no place for it."
    return f"Argument {before[place]} must be {_values(option)}, but is {' '.join([*before[place + 1 :], extra])}."


def _wrong_value(error: Any) -> str:
    """Line about a value of the wrong kind; converters of the options say themselves what it must be."""
    ours = str(error.msg or "")
    token, argument = error.token, error.argument
    if ours.startswith("must "):
        return f"Argument {token.keyword or _name(argument)} {ours}"
    must = _choices(error.target_type) or _WORDS.get(error.target_type)
    if token is None or argument is None or must is None:
        return ""
    value = token.value or _after_sign(error, token.keyword)
    if argument.hint is not error.target_type and _count(argument) > 1:
        must = _values(argument)
    if error.target_type in (int, float):
        end = number_suggestion(value, kind=error.target_type)
    else:
        end = suggestion(value, map(str, get_args(error.target_type)))
    return f"Argument {token.keyword or _name(argument)} must be {must}, but is {value or 'empty'}{end}"


def _after_sign(error: cyclopts.CycloptsError, keyword: str | None) -> str:
    """The text behind `--option=`, which the parser does not pass on."""
    tokens = [token for token in error.root_input_tokens or () if token.startswith(f"{keyword}=")]
    return tokens[-1].partition("=")[2] if tokens else ""


def _repeated(error: Any) -> str:
    return f"Argument {error.token.keyword} must be given only once."


def _arguments(error: cyclopts.CycloptsError) -> Sequence[Any]:
    """The arguments of the command."""
    return [] if error.app is None else list(error.app.assemble_argument_collection())


def _names(argument: Any) -> list[str]:
    """The names of an option, without --empty-star and the like, which the parser adds and the commands do not have."""
    return [name for name in argument.names if not name.startswith("--empty-")]


def _name(argument: Any) -> str:
    """The name of an option; an argument without one in capitals."""
    return argument.name if argument.name.startswith("-") else argument.name.upper()


def _count(argument: Any) -> int:
    return argument.token_count()[0]


def _takes_text(argument: Any) -> bool:
    """True if any single word is a value of the argument: what follows that belongs to no argument."""
    kinds = set(get_args(argument.hint) or [argument.hint]) - {type(None)}
    return kinds <= {str, Path}


def _values(argument: Any) -> str:
    """The values of an argument, in words."""
    count = _count(argument)
    if count > 1:
        return f"{count} numbers" if _takes_numbers(argument) else f"{count} values"
    kinds = [part for part in get_args(argument.hint) if part is not type(None)]
    kind = kinds[0] if len(kinds) == 1 and get_origin(argument.hint) is not Literal else argument.hint
    return _choices(kind) or _WORDS.get(kind, "a value")


def _takes_numbers(argument: Any) -> bool:
    """True if all values of an argument are numbers."""

    def single(kind: Any) -> set[Any]:
        parts = get_args(kind)
        return set().union(*map(single, parts)) if parts else {kind}

    return single(argument.hint) - {type(None), Ellipsis, list, tuple} <= {int, float}


def _choices(kind: Any) -> str:
    """The words that a choice is between."""
    return either([str(word) for word in get_args(kind)]) if get_origin(kind) is Literal else ""


_LINES: dict[type[cyclopts.CycloptsError], Any] = {
    cyclopts.UnknownCommandError: _unknown_command,
    cyclopts.UnknownOptionError: _unknown_option,
    cyclopts.MissingArgumentError: _no_value,
    cyclopts.UnusedCliTokensError: _too_many,
    cyclopts.CoercionError: _wrong_value,
    cyclopts.RepeatArgumentError: _repeated,
}
