"""What all adapters share: arguments, the scene, times."""
import argparse
import json
import os
import sys
import time


class Unsupported(Exception):
    """The renderer cannot do this scene."""


def unsupported(why):
    raise Unsupported(why)


def rgb(v):
    """A spectrum of a scene as three numbers."""
    return [float(v)] * 3 if isinstance(v, (int, float)) else [float(x) for x in v]


def arguments(extra=None):
    p = argparse.ArgumentParser()
    p.add_argument("scene", nargs="?")
    p.add_argument("--volumes", default=".")
    p.add_argument("-o", "--output")
    p.add_argument("--resolution")
    p.add_argument("--spp", type=int, default=4)
    p.add_argument("--seed", type=int, default=0)
    p.add_argument("--threads", type=int, default=0)
    p.add_argument("--check", action="store_true")
    if extra:
        extra(p)
    a = p.parse_args()
    a.threads = a.threads or os.cpu_count()
    return a


class Clock:
    """CPU and wall-clock seconds of this process."""

    def __init__(self):
        self.start = self.now()
        self.begin = self.start

    @staticmethod
    def now():
        t = os.times()
        return time.perf_counter(), t.user + t.system

    def rendering(self):
        """Everything until now was loading."""
        self.begin = self.now()

    def result(self):
        """What the benchmark reads."""
        import resource
        wall, cpu = self.now()
        print("RESULT " + json.dumps({
            "render_wall": wall - self.begin[0],
            "render_cpu": cpu - self.begin[1],
            "load": self.begin[0] - self.start[0],
            "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        }), flush=True)


class Scene:
    """A scene in plain data: camera, lights, rectangles and spheres with Lambertian materials, media in boxes, spheres and grids."""

    def __init__(self, a):
        with open(a.scene) as f:
            s = json.load(f)
        self.camera = s["camera"]
        if self.camera["type"] != "perspective":
            unsupported("only perspective cameras")
        self.size = [int(v) for v in a.resolution.split("x")] if a.resolution else s["film"]["resolution"]
        self.lights, self.environment = [], None
        for light in s.get("lights", []):
            if light["type"] == "environment" and "radiance" in light:
                self.environment = rgb(light["radiance"])
            elif light["type"] in ("distant", "point", "spot"):
                self.lights.append(light)
            else:
                unsupported(f"a light of type {light['type']}")
        self.materials = s.get("materials", {})
        self.shapes = [self.shape(x) for x in s.get("shapes", [])]
        self.media = [self.medium(n, m, a.volumes, os.path.dirname(a.scene)) for n, m in s.get("media", {}).items()]
        if len(self.media) > 1:
            unsupported("more than one medium: overlapping media do not superpose there")

    def shape(self, s):
        if s["type"] not in ("rectangle", "sphere") or "interior" in s:
            unsupported(f"a shape of type {s['type']}" + (" with an interior" if "interior" in s else ""))
        reflectance = [0.0] * 3
        if "material" in s:
            m = self.materials[s["material"]]
            if m["plugin"] != "diffuse":
                unsupported(f"a material of type {m['plugin']}")
            reflectance = rgb(m.get("params", {}).get("reflectance", 0.5))
        s = dict(s, reflectance=reflectance)
        if s["type"] == "rectangle":
            c, u, v = s["corner"], s["edge_u"], s["edge_v"]
            plus = lambda *p: [sum(x) for x in zip(*p)]
            s["vertices"] = [c, plus(c, u), plus(c, u, v), plus(c, v)]
        elif "emission" in s:
            unsupported("a shining sphere")
        return s

    def medium(self, name, m, volumes, base_of_scene):
        import numpy as np
        p = m.get("params", {})
        if m["plugin"] not in ("vdb", "homogeneous") or "transform" in m:
            unsupported(f"a medium of type {m['plugin']}")
        if any(k in p for k in ("temperature_grid", "emission_grid", "emission", "albedo_grid", "color_grid", "sigma_a", "sigma_s")):
            unsupported("a medium that emits, or with further grids")
        phase = p.get("phase", {"plugin": "isotropic"})
        if phase["plugin"] not in ("isotropic", "hg"):
            unsupported(f"a phase function of type {phase['plugin']}")
        out = {
            "kind": m["plugin"], "sigma_t": rgb(p.get("sigma_t", 1)), "albedo": rgb(p.get("albedo", 1)),
            "g": float(phase.get("params", {}).get("g", 0)) if phase["plugin"] == "hg" else 0.0,
        }
        if m["plugin"] == "vdb":
            base = os.path.join(volumes, name)
            with open(base + ".json") as f:
                about = json.load(f)
            nx, ny, nz = about["shape"]
            grid = np.fromfile(base + ".raw", "<f4").reshape(nz, ny, nx)
            to_world = np.array(about["to_world"])
            if np.abs(to_world[:, :3] - np.diag(np.diag(to_world[:, :3]))).max() > 1e-9:
                unsupported("a grid that is turned or sheared")
            first, shape = np.array(about["first"]), np.array(about["shape"])
            scale, offset = np.diag(to_world[:, :3]), to_world[:, 3]
            # Cells of voxels reach half a voxel beyond their centres.
            out.update(grid=grid, low=(first - 0.5) * scale + offset, high=(first + shape - 0.5) * scale + offset,
                       support=((first + 0.0) * scale + offset, (first + shape - 1.0) * scale + offset),
                       file=os.path.abspath(os.path.join(base_of_scene, p["file"])),
                       grid_name=p.get("grid", "density"))
        elif "bounds" in p:
            out.update(low=np.array(p["bounds"][:3], float), high=np.array(p["bounds"][3:], float))
        elif "radius" in p:
            out.update(center=p.get("center", [0, 0, 0]), radius=p["radius"])
        else:
            unsupported("a medium without bounds")
        return out


def main(check, render):
    """Runs an adapter: `check()` returns a version, `render(a, clock)` renders."""
    try:
        a = render.arguments() if hasattr(render, "arguments") else arguments()
        if a.check:
            print(check(a))
            return 0
        render(a, Clock())
        return 0
    except Unsupported as e:
        print(e, file=sys.stderr)
        return 4
    except (ImportError, OSError) as e:
        print(f"{type(e).__name__}: {e}", file=sys.stderr)
        return 1
