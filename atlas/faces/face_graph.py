"""The graph of faces for other tools: networkx, GraphML (yEd, Gephi, Cytoscape) and JSON."""

import json
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np

from touchatlas.atlas.files import write_whole

if TYPE_CHECKING:
    from touchatlas.atlas.faces.faces import Faces


def as_networkx(faces: "Faces") -> nx.MultiGraph:
    """Faces as nodes, edges keyed by their kind; every attribute is a number or words.

    Nodes have ``kind``, ``words``, ``samples``, ``explained``, ``deviation``, ``x``, ``y``, ``z``
    of the middle, the number of ``patches`` where labels tell it (``Atlas.graph`` has those of a
    body of one face), and the numbers of the law: ``radius``, ``axis_x`` and so on. Edges have
    ``kind``, ``length``, ``angle_deg``, ``gap``, ``deviation``, ``curves``, and the ``radius`` of
    their rounding with its deviation ``radius_std``. Lengths are in the user's unit.
    """
    if type(faces).__name__ != "Faces":
        raise ValueError(f"got {type(faces).__name__}; give the Faces that Atlas.faces() returns")
    graph = nx.MultiGraph()
    for face in faces.faces:
        x, y, z = face.middle.tolist()
        graph.add_node(
            face.id,
            kind=face.kind,
            words=face.words,
            samples=len(face.samples),
            explained=face.explained,
            deviation=face.deviation,
            x=x,
            y=y,
            z=z,
            **({"patches": len(face.pieces)} if face.pieces else {}),
            **_flat(face.law.numbers if face.law else {}),
        )
    for edge in faces.edges:
        graph.add_edge(
            edge.first,
            edge.second,
            key=edge.kind.value,
            kind=edge.kind.value,
            length=edge.length,
            angle_deg=float(np.rad2deg(edge.angle)),
            gap=edge.gap,
            deviation=edge.deviation,
            curves=len(edge.curves),
            radius=edge.radius,
            radius_std=edge.radius_std,
        )
    return graph


def _flat(numbers: dict[str, float | list[float]]) -> dict[str, float]:
    """Numbers with vectors taken apart into x, y and z: GraphML has no lists."""
    out: dict[str, float] = {}
    for name, value in numbers.items():
        if isinstance(value, list):
            out |= {f"{name}_{c}": v for c, v in zip("xyz", value, strict=True)}
        else:
            out[name] = value
    return out


def write_graphml(faces: "Faces", path) -> None:
    """Write the graph of faces as GraphML, valid by its schema, whole or not at all.

    Raises
    ------
    ValueError
        When the arguments are no ``Faces`` and no path.
    """
    graph = as_networkx(faces)
    # Keys become the ids of edges, which are unique in a file and hold no blanks.
    edges = [(a, b, f"e{i}", data) for i, (a, b, data) in enumerate(graph.edges(data=True))]
    unique = nx.MultiGraph()
    unique.add_nodes_from(graph.nodes(data=True))
    unique.add_edges_from(edges)
    text = "\n".join(nx.generate_graphml(unique)) + "\n"
    write_whole(path, text.encode())


def as_json(faces: "Faces") -> dict[str, Any]:
    """The graph as node-link data for ``networkx.node_link_graph(data, edges="edges")``, with laws
    as vectors, the points of the curves, and ``corners`` that are rounded with one ball."""
    data: dict[str, Any] = nx.node_link_data(as_networkx(faces), edges="edges")
    for node, face in zip(data["nodes"], faces.faces, strict=True):
        node["law"] = face.law.numbers if face.law else None
    points = {
        (e.first, e.second, e.kind.value): [c.tolist() for c in e.curves] for e in faces.edges
    }
    for edge in data["edges"]:
        edge["points"] = points[(edge["source"], edge["target"], edge["key"])]
    corners = [
        {
            "faces": list(corner.faces),
            "kind": "convex" if corner.sign > 0.0 else "concave",
            "radius": corner.radius,
            "centre": corner.centre.tolist(),
            "samples": len(corner.samples),
        }
        for corner in faces.corners
    ]
    return data | {"corners": corners, "unexplained": faces.unexplained}


def write_json(faces: "Faces", path) -> None:
    """Write the graph of faces as JSON, whole or not at all.

    Raises
    ------
    ValueError
        When the arguments are no ``Faces`` and no path.
    """
    write_whole(path, (json.dumps(as_json(faces), indent=1) + "\n").encode())
