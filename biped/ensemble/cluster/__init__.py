"""Workers elsewhere: a Dask scheduler and whoever works for it, as an executor's backend (docs/clusters.md).

Nothing here is imported unless a command asks for a cluster.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from biped.base.errors import InputError, safe
from biped.ensemble.backend import Backend, Told

if TYPE_CHECKING:
    from biped.ensemble.cluster.tasks import Connection

WAIT = 600.0
"""[s] that a scheduler or a worker is waited for, unless a file says otherwise."""


class DaskCluster:
    """A Dask scheduler's workers, as `biped.ensemble.backend.Cluster`.

    Args:
        connection: To the scheduler.
        same: Whether workers on another kind of machine are refused.
        tell: Told what a person should know.
    """

    def __init__(self, connection: Connection, same: bool, tell: Told):
        self._connection, self._same, self._tell = connection, same, tell

    def backend(self, work: Callable[[Any], Any]) -> Backend:
        """See `biped.ensemble.backend.Cluster`."""
        from biped.ensemble.cluster.tasks import Tasks

        return Tasks(self._connection, work, self._same, self._tell)


@contextmanager
def cluster_at(where: str, same: bool, tell: Told) -> Iterator[DaskCluster]:
    """The cluster that `--cluster` names, which is let go when the block ends.

    Args:
        where: Address of a scheduler, `local:N`, or a TOML file.
        same: Whether workers on another kind of machine are refused.
        tell: Told what a person should know.

    Raises:
        InputError: There is no such cluster.
    """
    from biped.ensemble.cluster.local import Local
    from biped.ensemble.cluster.tasks import Connection
    from biped.ensemble.cluster.worker import needed

    needed()
    with ExitStack() as stack:
        if found := re.fullmatch(r"local:(\d{1,4})", where, re.ASCII):
            if int(found[1]) < 1:
                raise InputError(f"--cluster {where}: expected at least one worker")
            local = Local(int(found[1]))
            stack.callback(local.close)
            connection = Connection(local.connect, where, WAIT, "they are starting", local.trouble, local.mend)
        elif where.startswith(("tcp://", "tls://")):
            from biped.ensemble.cluster.tasks import connecting

            remedy = f"biped worker {where} starts one"
            connection = Connection(connecting(where, {}), where, WAIT, remedy)
        elif where.endswith(".toml"):
            from biped.ensemble.cluster.file import from_file

            connection = from_file(where, stack)
        else:
            raise InputError(
                f"--cluster {safe(where)}: expected the address of a Dask scheduler (tcp://host:8786 or tls://…), "
                "local:N, or a file *.toml"
            )
        stack.callback(connection.close)
        if link := connection.dashboard():
            tell(f"{connection.place}: dashboard at {link}")
        yield DaskCluster(connection, same, tell)
