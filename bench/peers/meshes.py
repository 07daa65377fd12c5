"""Reads and writes triangle meshes with numpy alone, so that reading costs every method the same."""

import numpy as np

TYPES = {
    "float": "<f4", "float32": "<f4", "double": "<f8", "float64": "<f8",
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "<i2", "int16": "<i2",
    "ushort": "<u2", "uint16": "<u2", "int": "<i4", "int32": "<i4", "uint": "<u4", "uint32": "<u4",
}  # fmt: skip


def read_ply(path):
    """Vertices (f64) and triangles (i32) of a binary little-endian PLY whose faces are triangles only."""
    with open(path, "rb") as file:
        data = file.read()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    fields = {"vertex": [], "face": []}
    counts, element = {}, ""
    for line in data[:end].decode("ascii").splitlines():
        words = line.split()
        if words[0] == "format" and words[1] != "binary_little_endian":
            raise ValueError(f"{path}: {words[1]} is not supported")
        if words[0] == "element":
            element = words[1]
            counts[element] = int(words[2])
        elif words[0] == "property" and words[1] == "list":
            fields[element] += [("count", TYPES[words[2]]), ("corners", TYPES[words[3]], 3)]
        elif words[0] == "property":
            fields[element].append((words[2], TYPES[words[1]]))
    vertices = np.frombuffer(data, np.dtype(fields["vertex"]), counts["vertex"], end)
    faces = np.frombuffer(data, np.dtype(fields["face"]), counts["face"], end + vertices.nbytes)
    if (faces["count"] != 3).any():
        raise ValueError(f"{path}: not all faces are triangles")
    points = np.stack([vertices[axis] for axis in "xyz"], axis=1).astype(np.float64)
    return points, faces["corners"].astype(np.int32)


def write_ply(path, points, faces):
    """Binary little-endian, doubles."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.empty(len(faces), np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    rows["count"], rows["corners"] = 3, faces
    with open(path, "wb") as file:
        file.write(header.encode("ascii") + np.asarray(points, "<f8").tobytes() + rows.tobytes())


def write_medit(path, points, faces):
    """The text format of MMG."""
    with open(path, "w", encoding="ascii") as file:
        file.write(f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(points)}\n")
        np.savetxt(file, np.column_stack([points, np.zeros(len(points))]), fmt="%.17g %.17g %.17g %d")
        file.write(f"Triangles\n{len(faces)}\n")
        np.savetxt(file, np.column_stack([faces + 1, np.ones(len(faces), int)]), fmt="%d")
        file.write("End\n")


def read_medit(path):
    """Vertices and triangles of a text file of MMG, which may have more in it."""
    with open(path, encoding="ascii") as file:
        words = file.read().split()

    def block(name, columns, kind):
        at = words.index(name)
        count = int(words[at + 1])
        return np.array(words[at + 2 : at + 2 + columns * count], kind).reshape(count, columns)

    return block("Vertices", 4, np.float64)[:, :3], block("Triangles", 4, np.int32)[:, :3] - 1


def write_off(path, points, faces):
    """Text."""
    with open(path, "w", encoding="ascii") as file:
        file.write(f"OFF\n{len(points)} {len(faces)} 0\n")
        np.savetxt(file, points, fmt="%.17g")
        np.savetxt(file, np.column_stack([np.full(len(faces), 3), faces]), fmt="%d")


def read_off(path):
    """Text with triangles only."""
    with open(path, encoding="ascii") as file:
        words = file.read().split()
    vertices, faces = int(words[1]), int(words[2])
    points = np.array(words[4 : 4 + 3 * vertices], np.float64).reshape(-1, 3)
    rows = np.array(words[4 + 3 * vertices : 4 + 3 * vertices + 4 * faces], np.int32).reshape(-1, 4)
    return points, rows[:, 1:]


def hexagonal_edge(points, faces, count):
    """Edge length of `count` points in a hexagonal layout over the surface."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    return float(np.sqrt(2.0 * area / (np.sqrt(3.0) * count)))
