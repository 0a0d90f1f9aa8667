"""What converters share: the stage, the time, the report and the scene."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pxr import Ar, Sdf, Usd, UsdGeom

from .claim import Claim
from .groups import Group
from .report import InputError, Report
from .scene import Files, Json, Matrix, Scene

if TYPE_CHECKING:
    from .render_settings import RenderSettings
    from .traverse import Walk


@dataclass(frozen=True)
class Options:
    """What the command line says."""

    frame: float | None = None
    """Time code; None is the first one of the stage."""
    purposes: tuple[str, ...] | None = None
    """Purposes that are drawn; None is what the render settings say, else default and render."""
    variants: tuple[tuple[str, str, str], ...] = ()
    """Prim path, variant set, selection."""
    camera: str | None = None
    render_settings: str | None = None
    subdivision: int = 2
    """Level of Catmull–Clark subdivision: each face becomes 4^level quadrilaterals."""
    curve_sides: int = 6
    """Sides of the tubes that curves become."""
    keep_going: bool = False


@dataclass(frozen=True)
class Look:
    """What a surface is made of."""

    shape: Json
    """Keys of the scene's shape: material, emission, emission_texture, two_sided, interior, priority."""
    uv: str | None = None
    """The primvar (without "primvars:") with the texture coordinates of the material's textures."""
    colors: bool = False
    """True if textures read the corners' colours: displayColor and displayOpacity."""


class Context:
    """One conversion."""

    def __init__(self, stage: Usd.Stage, options: Options, scene_file: Path, report: Report | None = None) -> None:
        self.stage = stage
        self.options = options
        self.report = report or Report()
        self.files = Files(scene_file)
        self.scene = Scene(self.files)
        self.world = Group("world")
        self.time = time_code(stage, options.frame)
        self.xforms = UsdGeom.XformCache(self.time)
        self.meters_per_unit = float(UsdGeom.GetStageMetersPerUnit(stage))
        self.up_axis = str(UsdGeom.GetStageUpAxis(stage))
        self.used: set[tuple[str, str]] = set()
        """(prim path, property) used by another prim than its own: inherited primvars, bound materials, fields."""
        self.corners: list[Matrix] = []
        """World positions of corners of boxes that usd-core does not know: those of volumes, (8, 3) each."""
        self.claims: list[Claim] = []
        self.cameras: list[tuple[str, Matrix]] = []
        """Prim paths and matrices to the world of the cameras that the walk met."""
        self.settings: RenderSettings
        self.purposes: tuple[str, ...] = options.purposes or ("default", "render")
        self.walk: Walk
        """The walk under way: converters go down into prototypes with it."""

    def claim(self, prim: Usd.Prim, matrix: Matrix, group: Group, purpose: str = "default") -> Claim:
        """Takes a prim on; what its converter does not use is reported at the end."""
        claim = Claim(self, prim, matrix, group, purpose)
        self.claims.append(claim)
        return claim

    def material_for(self, claim: Claim, subset: Claim | None = None) -> Look | None:
        """What a gprim, or a GeomSubset of it, is made of; None if no material is bound."""
        from . import materials

        return materials.material_for(self, claim, subset)

    def file(self, claim: Claim, attribute: str, asset: Sdf.AssetPath) -> str:
        """How the scene names the file of an asset path. Files in packages (usdz) are copied beside the scene."""
        resolved = asset.resolvedPath
        if not resolved:
            raise InputError(f"{claim.path}.{attribute}", f"can't find the file '{asset.path}'")
        return self.plain_file(claim, attribute, resolved)

    def plain_file(self, claim: Claim, attribute: str, resolved: str) -> str:
        """The same for a path that is resolved already."""
        if not Ar.IsPackageRelativePath(resolved):
            return self.files.relative(resolved)
        opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
        if opened is None:
            raise InputError(f"{claim.path}.{attribute}", f"can't read '{resolved}'")
        inner = Path(Ar.SplitPackageRelativePathInner(resolved)[1])
        with opened:
            return self.files.add(inner.stem, inner.suffix, [bytes(opened.GetBuffer())])


def time_code(stage: Usd.Stage, frame: float | None) -> Usd.TimeCode:
    """The time of a conversion: the frame, else the stage's start, else its earliest values."""
    if frame is not None:
        return Usd.TimeCode(frame)
    if stage.HasAuthoredTimeCodeRange():
        return Usd.TimeCode(stage.GetStartTimeCode())
    return Usd.TimeCode.EarliestTime()
