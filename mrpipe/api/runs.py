"""A run directory in a notebook: models, responses and the verdict that `mrpipe run` left."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrpipe.artifacts import Artifact
from mrpipe.errors import UserError

if TYPE_CHECKING:
    import pandas as pd
    import xarray

    from mrpipe.dampers.model import DamperModel
    from mrpipe.networks.network import Network
    from mrpipe.structures import Frame


@dataclass(frozen=True)
class Run:
    """Contents of a run directory; everything is read when it is used.

    Attributes
    ----------
    directory
        The run directory.
    """

    directory: Path

    def __str__(self) -> str:
        names = ", ".join(sorted(path.name for path in self.directory.glob("*.h5")))
        return f"run {self.directory.name}: {names or 'no artifacts'}"

    def artifact(self, name: str) -> Artifact:
        """Return an artifact by its file name, with or without `.h5`.

        Raises
        ------
        UserError
            If the run has no such artifact.
        """
        path = self.directory / (name if name.endswith(".h5") else f"{name}.h5")
        if not path.is_file():
            known = ", ".join(sorted(item.stem for item in self.directory.glob("*.h5"))) or "none"
            raise UserError(self.directory, path.name, "is not in this run", f"artifacts: {known}")
        return Artifact(path)

    def dataset(self, name: str, group: str = "/") -> xarray.Dataset:
        """Return a group of an artifact as an xarray dataset, with the axes and units of the artifact.

        Parameters
        ----------
        name
            File name of the artifact, with or without `.h5`.
        group
            Group inside the artifact.

        Raises
        ------
        UserError
            If the run has no such artifact, or xarray is not installed.
        """
        path = self.artifact(name).path
        try:
            import h5netcdf  # noqa: F401 - xarray needs it to read the file
            import xarray
        except ImportError as error:
            raise UserError("dataset", str(error.name), "is not installed", "pip install 'mrpipe[xarray]'") from error
        return xarray.load_dataset(path, engine="h5netcdf", group=group)

    @property
    def damper(self) -> DamperModel:
        """The identified damper."""
        from mrpipe.dampers.model import read_damper

        return read_damper(self.artifact("damper"))

    @property
    def damper_traced(self) -> DamperModel:
        """The damper with the effects that close-loop named."""
        from mrpipe.effects.damper import read_damper

        return read_damper(self.artifact("damper-traced"))

    @property
    def frame(self) -> Frame:
        """The identified structure."""
        from mrpipe.structures import read_frame

        return read_frame(self.artifact("frame"))

    @property
    def verdict(self) -> dict[str, Any]:
        """Verdict of close-loop, as `mrpipe close-loop --json` prints it."""
        path = self.directory / "close-loop.json"
        if not path.is_file():
            raise UserError(self.directory, path.name, "is not in this run", "run mrpipe close-loop first")
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return found

    def network(self, kind: str) -> Network:
        """Return the `forward` or `inverse` network."""
        from mrpipe.networks.network import read_network

        return read_network(self.artifact(kind), "network")

    def response(self, law: str) -> pd.DataFrame:
        """Return the histories of a simulated law in SI units, a column for each history and floor.

        The columns have the names of the artifact: `time`, `force`, `displacement_1` for floor 1.
        """
        import pandas as pd

        from mrpipe.simulation.storage import read_histories

        columns: dict[str, Any] = {}
        for name, values in read_histories(self.artifact(f"response-{law}")).items():
            if values.ndim == 1:
                columns[name] = values
            else:
                columns.update({f"{name}_{floor + 1}": values[:, floor] for floor in range(values.shape[1])})
        length = len(columns["time"])
        return pd.DataFrame({name: values for name, values in columns.items() if len(values) == length})


def open_run(directory: str | Path) -> Run:
    """Open a run directory.

    Raises
    ------
    UserError
        If there is no such directory, or no run has written it.
    """
    path = Path(directory)
    if not path.is_dir():
        raise UserError(path, "", "is not a run directory", "give the directory that mrpipe run printed")
    foreign = any(path.iterdir()) and not any(path.glob("*.h5"))
    if foreign and not (path / "manifests").is_dir():
        problem = "is not a run directory, because it has no manifests of stages and no artifacts"
        raise UserError(path, "", problem, "give the directory that mrpipe run printed")
    return Run(path)
