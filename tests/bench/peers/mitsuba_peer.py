"""Mitsuba 3."""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scene as common


def options(p):
    p.add_argument("--variant", default="llvm_ad_rgb")


def variant(a):
    import glob
    if "DRJIT_LIBLLVM_PATH" not in os.environ:
        found = [f for v in (19, 20, 18, 17, 15, 14) for f in glob.glob(f"/usr/lib/*/libLLVM*{v}*.so*")]
        if found:
            os.environ["DRJIT_LIBLLVM_PATH"] = found[0]
    import mitsuba as mi
    mi.set_variant(a.variant)
    if a.variant.startswith("llvm"):
        import drjit as dr
        dr.eval(dr.arange(mi.Float, 4) + 1)  # fails here if there is no LLVM
    return mi


def check(a):
    return variant(a).__version__


def describe(mi, s):
    import numpy as np
    T = mi.ScalarTransform4f
    color = lambda v: {"type": "rgb", "value": v}
    integrator = "volpath" if s.media else "path"
    out = {
        "type": "scene",
        "integrator": {"type": integrator, "max_depth": -1},
        "sensor": {
            "type": "perspective", "fov": s.camera["fov_x_deg"], "fov_axis": "x", "near_clip": 1e-3, "far_clip": 1e6,
            "to_world": T().look_at(origin=s.camera["origin"], target=s.camera["target"], up=s.camera.get("up", [0, 1, 0])),
            "film": {"type": "hdrfilm", "width": s.size[0], "height": s.size[1], "pixel_format": "rgb",
                     "component_format": "float32", "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": 4},
        },
    }
    for i, m in enumerate(s.media):
        grey = len(set(m["sigma_t"])) == 1
        med = {"phase": {"type": "hg", "g": m["g"]} if m["g"] else {"type": "isotropic"}}
        med["albedo"] = m["albedo"][0] if len(set(m["albedo"])) == 1 else {"type": "constvolume", "value": color(m["albedo"])}
        if grey:
            med["has_spectral_extinction"] = False
        if m["kind"] == "vdb":
            values = m["grid"][..., None] if grey else m["grid"][..., None] * np.array(m["sigma_t"], np.float32)
            to_world = T().translate(m["low"].tolist()).scale((m["high"] - m["low"]).tolist())
            med.update(type="heterogeneous", scale=m["sigma_t"][0] if grey else 1.0, sigma_t={
                "type": "gridvolume", "grid": mi.VolumeGrid(np.ascontiguousarray(values)), "to_world": to_world,
                "filter_type": "trilinear", "wrap_mode": "clamp", "raw": True})
            low, high = m["support"]
        else:
            med.update(type="homogeneous", sigma_t=m["sigma_t"][0] if grey else color(m["sigma_t"]))
            low, high = m.get("low"), m.get("high")
        boundary = {"bsdf": {"type": "null"}, "interior": med}
        if "radius" in m:
            boundary.update(type="sphere", center=m["center"], radius=m["radius"])
        else:
            low, high = np.array(low, float), np.array(high, float)
            boundary.update(type="cube", to_world=T().translate(((low + high) / 2).tolist()).scale(((high - low) / 2).tolist()))
        out[f"medium{i}"] = boundary
    if s.environment:
        out["environment"] = {"type": "constant", "radiance": color(s.environment)}
    for i, l in enumerate(s.lights):
        if l["type"] == "distant":
            if l.get("angle_deg", 0):
                common.unsupported("a sun with a size")
            d = {"type": "directional", "direction": [-x for x in l["to_light"]], "irradiance": color(common.rgb(l["irradiance"]))}
        elif l["type"] == "point":
            d = {"type": "point", "position": l["position"], "intensity": color(common.rgb(l["intensity"]))}
        else:
            common.unsupported("a spot light, whose rim falls off differently there")
        out[f"light{i}"] = d
    for i, x in enumerate(s.shapes):
        bsdf = {"type": "diffuse", "reflectance": color(x["reflectance"])}
        if x["type"] == "sphere":
            out[f"shape{i}"] = {"type": "sphere", "center": x["center"], "radius": x["radius"], "bsdf": bsdf}
            continue
        v = np.array(x["vertices"], float)
        u, w = (v[1] - v[0]) / 2, (v[3] - v[0]) / 2
        n = np.cross(u, w)
        m = np.eye(4)
        m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = u, w, n / np.linalg.norm(n), v.mean(0)
        o = {"type": "rectangle", "to_world": T(m), "bsdf": bsdf}
        if "emission" in x:
            o["emitter"] = {"type": "area", "radiance": color(common.rgb(x["emission"]))}
        out[f"shape{i}"] = o
    return out


def render(a, clock):
    mi = variant(a)
    import drjit as dr
    import numpy as np
    dr.set_thread_count(a.threads)
    mi.set_log_level(mi.LogLevel.Error)
    s = common.Scene(a)
    scene = mi.load_dict(describe(mi, s))
    clock.rendering()
    # One pass holds a million paths at most; passes are averaged in double precision.
    total, done, k = np.zeros((s.size[1], s.size[0], 3)), 0, 0
    most = max(1, (1 << 20) // (s.size[0] * s.size[1])) if a.variant.startswith("llvm") else a.spp
    while done < a.spp:
        n = min(most, a.spp - done)
        total += n * np.array(mi.render(scene, spp=n, seed=(a.seed * 1000003 + k) % 2**31), dtype=np.float64)
        done, k = done + n, k + 1
    clock.result()
    mi.Bitmap((total / done).astype(np.float32)).write(a.output)


render.arguments = lambda: common.arguments(options)
if __name__ == "__main__":
    sys.exit(common.main(check, render))
