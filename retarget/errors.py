"""What can go wrong, as one sentence a user can act on.

Every error that a user can cause or meet is a `RetargetError`; the command line prints its text and exits with status
1. A message names the thing, what was expected and the next step.
"""


class RetargetError(Exception):
    """Base of all errors of this package."""


class InputError(RetargetError):
    """A file, an option or a stream holds something that cannot be used."""


class OutputError(RetargetError):
    """A file or a receiver cannot be written to."""


class ProtocolError(RetargetError):
    """Bytes that do not follow the protocol they came in; the only exception a decoder raises."""


class ConnectionFailedError(RetargetError):
    """A peer does not answer, or an address cannot be used."""


class DisplayError(RetargetError):
    """No picture can be drawn on this machine, as it is set up."""
