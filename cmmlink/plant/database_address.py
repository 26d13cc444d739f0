"""Where results are stored: a file of SQLite, or a PostgreSQL server. No password is ever part of an address.

For PostgreSQL its own password file serves: `~/.pgpass`, or the one that the address names with `?passfile=FILE`.
"""

import re
from pathlib import Path
from urllib.parse import parse_qsl, urlsplit

from cmmlink.errors import PlantError

SERVER = "postgresql+psycopg"
_SCHEMES = ("postgresql", "postgres", SERVER)
_SECRETS = ("password", "sslpassword")
_PASSWORD = re.compile(r"(?i)(?<=://)([^\s/@:]*):[^\s/]*@|(?<=password=)[^\s&]*")


def address_of(given: str | Path) -> str:
    """The address as the database library takes it.

    given : the path of a file, sqlite:///FILE, or postgresql://USER@HOST/DATABASE with options of PostgreSQL's own library behind `?`

    Raises PlantError for what is no address, and for a password in it.
    """
    text = str(given)
    scheme, found, _ = text.partition("://")
    if isinstance(given, Path) or not found:
        return f"sqlite:///{text}"
    if scheme == "sqlite":
        return text
    if scheme not in _SCHEMES:
        raise PlantError(f"{without_password(text)}: expected the path of a file, or postgresql://USER@HOST/DATABASE")
    try:
        parts = urlsplit(text)
        is_secret = parts.password is not None or any(key.lower() in _SECRETS for key, _ in parse_qsl(parts.query))
        is_whole = bool(parts.path.strip("/")) and (parts.port is None or parts.port > 0)
    except ValueError as error:
        raise PlantError(f"{without_password(text)}: is no address: {error}") from None
    if is_secret:
        raise PlantError(
            f"{without_password(text)}: a password in an address ends in logs and records; leave it out, and write it to ~/.pgpass or to "
            "the file that the address names with ?passfile=FILE, as HOST:PORT:DATABASE:USER:PASSWORD"
        )
    if not is_whole:
        raise PlantError(f"{text}: names no database; expected postgresql://USER@HOST/DATABASE")
    return f"{SERVER}://{text.partition('://')[2]}"


def is_server(address: str) -> bool:
    """Whether an address, as `address_of` gives it, is that of a server."""
    return address.startswith(f"{SERVER}://")


def words_of(address: str) -> str:
    """An address as people read it: without the options, and of a file its path."""
    if not is_server(address):
        return address.removeprefix("sqlite:///")
    return without_password(f"postgresql://{address.partition('://')[2].partition('?')[0]}")


def without_password(text: str) -> str:
    """The text with three dots in place of passwords in the addresses that it holds."""
    return _PASSWORD.sub(lambda found: f"{found[1]}:...@" if found[1] is not None else "...", text)
