"""Text on the wire: UTF-8 in principle, any bytes in practice, and nothing may be lost on the way back.

A byte that is not UTF-8 becomes one private character U+EF80 to U+EFFF, so that the text can be shown and written
anywhere and still gives the very same bytes again. A sender's own use of these 128 characters is kept too: it counts as
not UTF-8.
"""

from __future__ import annotations

from retarget.errors import InputError

_FIRST_OCTET = 0xEF00
_OCTETS = {_FIRST_OCTET + octet: octet for octet in range(0x80, 0x100)}


def text_from_octets(octets: bytes) -> str:
    """Read text; every sequence of bytes gives one, and a different one."""
    if octets.isascii():
        return octets.decode("ascii")
    try:
        text = octets.decode("utf-8")
    except UnicodeDecodeError:
        return _text_with_octets(octets)
    return _text_with_octets(octets) if _names_octets(text) else text


def octets_from_text(text: str) -> bytes:
    """Write text; the inverse of `text_from_octets`. Raise `InputError` for a lone surrogate."""
    if text.isascii():
        return text.encode("ascii")
    try:
        if not _names_octets(text):
            return text.encode("utf-8")
        return b"".join(_octets_of_character(character) for character in text)
    except UnicodeEncodeError as error:
        raise InputError(f"The name {text!r} cannot be written as UTF-8; rename it.") from error


def terminated(text: str) -> bytes:
    """Write text with its closing NUL; raise `InputError` when it holds a NUL itself."""
    octets = octets_from_text(text)
    if b"\0" in octets:
        raise InputError(f"The name {text!r} holds a NUL character, which NatNet uses to end names; rename it.")
    return octets + b"\0"


def _names_octets(text: str) -> bool:
    return any(ord(character) in _OCTETS for character in text)


def _octets_of_character(character: str) -> bytes:
    octet = _OCTETS.get(ord(character))
    return character.encode("utf-8") if octet is None else bytes((octet,))


def _text_with_octets(octets: bytes) -> str:
    """Decode piece by piece: surrogates mark what is not UTF-8, our private characters are spelt out byte by byte."""
    marked = octets.decode("utf-8", "surrogateescape")
    return "".join(_shown(character) for character in marked)


def _shown(character: str) -> str:
    code = ord(character)
    if 0xDC80 <= code <= 0xDCFF:
        return chr(_FIRST_OCTET + code - 0xDC00)
    if code in _OCTETS:
        return "".join(chr(_FIRST_OCTET + octet) for octet in character.encode("utf-8"))
    return character
