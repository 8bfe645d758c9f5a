"""Pose graphs in files: g2o and TORO, in the plane and in space, read and written."""

from sequential.slam.files.city import CityGraph, read_city
from sequential.slam.files.declaring import graph_of, problem_of
from sequential.slam.files.graph_file import Edges, GraphFile
from sequential.slam.files.reading import read_graph
from sequential.slam.files.writing import write_graph

__all__ = [
    "CityGraph",
    "Edges",
    "GraphFile",
    "graph_of",
    "problem_of",
    "read_city",
    "read_graph",
    "write_graph",
]
