"""Search and files by Open3D. Argument: the folder of the data. Then a line "job threads samples" or "read PATH threads samples" at a
time; the answer is a line of "bytes sum seconds..."."""
import os, sys, time
import numpy as np
import open3d as o3d

answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)  # what the library prints is no answer
o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
folder = sys.argv[1]


def content(name, kind, width):
    path = os.path.join(folder, name)
    return np.fromfile(path, kind).reshape(-1, width) if os.path.exists(path) else np.zeros((0, width), kind)


tensor = lambda array, kind: o3d.core.Tensor(np.ascontiguousarray(array.astype(kind)))
vertices, faces = tensor(content("vertices", "<f8", 3), np.float32), tensor(content("faces", "<u4", 3), np.uint32)
queries = {name: tensor(content(name, "<f8", 3), np.float32) for name in ("near", "far")}
rays = tensor(content("rays", "<f8", 6), np.float32)


def scene(threads):
    made = o3d.t.geometry.RaycastingScene(nthreads=threads)
    made.add_triangles(vertices, faces)
    made.compute_distance(queries["near"][:1], nthreads=threads)  # builds the tree
    return made


scenes = {}


def ready_scene(threads):
    if threads not in scenes:
        scenes[threads] = scene(threads)
    return scenes[threads]


def closest(name, threads):
    found = ready_scene(threads).compute_closest_points(queries[name], nthreads=threads)
    return lambda: np.linalg.norm(found["points"].numpy().astype(float) - queries[name].numpy(), axis=1).sum()


def first_hits(threads):
    ways = ready_scene(threads).cast_rays(rays, nthreads=threads)["t_hit"]
    return lambda: float(np.sum(ways.numpy()[np.isfinite(ways.numpy())], dtype=float))


def built(threads):
    scene(threads)
    return lambda: 0


def read(path):
    if path.endswith(".npy"):
        count = len(np.load(path))
    else:
        count = len(o3d.io.read_triangle_mesh(path).vertices)
    return lambda: count


has_faces = len(faces) > 0
jobs = {"triangles.build": built, "triangles.rays": first_hits, "triangles.near": lambda t: closest("near", t),
        "triangles.far": lambda t: closest("far", t)} if has_faces else {}
kinds = f";+Embree (Open3D {o3d.__version__}, 32 bits):" + ",".join(jobs) if jobs else f";Open3D {o3d.__version__}:read"
print("ready" + kinds, file=answers, flush=True)
for line in sys.stdin:
    job, *paths, threads, samples = line.split()
    seconds = []
    for _ in range(int(samples)):
        start = time.perf_counter()
        found = read(paths[0]) if paths else jobs[job](int(threads))
        seconds.append(time.perf_counter() - start)
    print(0, found(), *seconds, file=answers, flush=True)
