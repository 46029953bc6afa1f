"""Files that a model names and that are not there: what only draws is left out, what touches or weighs is an error."""

from pathlib import Path

import mujoco

from rebody.errors import RebodyError

_FROM_GEOMS = (mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE, mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO)


def leave_out_missing(spec: mujoco.MjSpec, robot: str) -> tuple[str, ...]:
    """Delete meshes, height fields and textures without a file, and the geoms that show them; the names of the files.

    RebodyError where the robot would move otherwise without one.
    """
    meshes, fields = _missing(spec, spec.meshes, spec.meshdir), _missing(spec, spec.hfields, spec.meshdir)
    textures = _missing(spec, spec.textures, spec.texturedir)
    for geom in list(spec.geoms):
        asset = meshes.get(geom.meshname) or fields.get(geom.hfieldname)
        if asset is None:
            continue
        if needed := _need(spec, geom):
            where = f"geom '{geom.name}' of body '{geom.parent.name}'"
            raise RebodyError(f"robot '{robot}': the file '{asset.file}' is not there, and {where} {needed}.")
        spec.delete(geom)
    for material in spec.materials:
        for i, name in enumerate(material.textures):
            if name in textures:
                material.textures[i] = ""
    left_out = [asset for assets in (meshes, fields, textures) for asset in assets.values()]
    files = tuple(Path(asset.file).name for asset in left_out)
    for asset in left_out:
        spec.delete(asset)
    return files


def _missing(
    spec: mujoco.MjSpec, assets, folder: str
) -> dict[str, mujoco.MjsMesh | mujoco.MjsHField | mujoco.MjsTexture]:
    """By name; where MuJoCo looks for them."""
    where = Path(spec.modelfiledir) / folder
    return {asset.name: asset for asset in assets if asset.file and not (where / asset.file).is_file()}


def _need(spec: mujoco.MjSpec, geom: mujoco.MjsGeom) -> str | None:
    """What it does beside being seen, if anything."""
    if geom.contype or geom.conaffinity:
        return "touches things with it"
    lowest, highest = spec.compiler.inertiagrouprange
    weighs = geom.mass > 0 or (geom.mass != geom.mass and geom.density > 0)  # NaN where it is by density
    is_counted = spec.compiler.inertiafromgeom in _FROM_GEOMS and lowest <= geom.group <= highest
    has_own = spec.compiler.inertiafromgeom == _FROM_GEOMS[1] and geom.parent.explicitinertial
    if weighs and is_counted and not has_own and geom.parent.name != "world":
        return "gives its body weight by it"
    return None
