"""The error for what the user gave and cannot be used."""


class InputError(ValueError):
    """A file or an option cannot be used; the message is for the person who gave it."""
