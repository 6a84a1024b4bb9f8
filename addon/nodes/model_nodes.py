# SPDX-License-Identifier: GPL-3.0-or-later
"""The reflectance models in node trees: their terms, from `models/`, over sockets."""

from ..closures.lobe import Weight
from ..models.registry import IOR as IOR_PARAMETER
from ..models.registry import MODELS, ReflectanceModel
from ..models.registry import ROUGHNESS as ROUGHNESS_PARAMETER
from ..models.terms import Light, Terms, View
from .graph import COLOR, Graph, Number, Socket, Value


def _meanings(name: str) -> str:
    """Return what the parameter of that name means to the models that have it, as one sentence for each meaning."""
    meanings: dict[str, list[str]] = {}
    for model in MODELS.values():
        if model.parameter and model.parameter.socket == name:
            meanings.setdefault(model.parameter.meaning, []).append(model.label)
    return ". ".join(f"{', '.join(labels)}: {meaning}" for meaning, labels in meanings.items())


ROUGHNESS_MEANING = _meanings(ROUGHNESS_PARAMETER.socket)
ROUGHNESS = Socket(
    ROUGHNESS_PARAMETER.socket,
    "NodeSocketFloat",
    f"0 is Lambert, chalk and clay are 0.3 to 0.5. {ROUGHNESS_MEANING}",
    ROUGHNESS_PARAMETER.usual,
    ROUGHNESS_PARAMETER.low,
    ROUGHNESS_PARAMETER.high,  # of the slider alone: what is typed may exceed it, and each model has a highest of its own
    subtype="FACTOR",
)
IOR = Socket(
    IOR_PARAMETER.socket,
    "NodeSocketFloat",
    _meanings(IOR_PARAMETER.socket),
    IOR_PARAMETER.usual,
    IOR_PARAMETER.low,
    IOR_PARAMETER.high,
)
N = Socket("N", "NodeSocketVector", "Shading normal at unit length", (0.0, 0.0, 0.0))
SOCKETS = {socket.name: socket for socket in (ROUGHNESS, IOR)}
"""The sockets of the models' parameters, by name."""


def parameters(model: ReflectanceModel) -> tuple[Socket, ...]:
    """Return the socket of the model's parameter, if it has one."""
    return (SOCKETS[model.parameter.socket],) if model.parameter else ()


class Surface:
    """A `model` in a group that has COLOR, N and the model's parameter as inputs: these inside their ranges, and the view."""

    def __init__(self, graph: Graph, model: ReflectanceModel) -> None:
        self.graph = graph
        self.n = graph.input(N)
        v = graph.geometry("Incoming")
        mu = graph.maximum(graph.dot(self.n, v), 0.0)
        across = v - self.n * mu
        self.tangent = graph.normalize(across)
        sine = graph.vector_math("LENGTH", across, output="Value")
        self.view = View(graph, graph.clamp(graph.input(COLOR), 0.0, 1.0), mu, sine)
        self.inputs = {"Color": self.view.color, "N": self.n}
        """What an inner group of the same model gets."""
        value = None
        if parameter := model.parameter:
            value = graph.clamp(graph.input(SOCKETS[parameter.socket]), parameter.low, parameter.high)
            self.inputs[parameter.socket] = value
        self.terms: Terms = model.terms(self.view, value)
        self._weights: dict[Weight, Number] = {}

    def light(self, l: Value) -> Light:
        """Return a light of direction `l`."""
        mu = self.graph.clamp(self.graph.dot(self.n, l), 0.0, 1.0)
        return Light(self.view, mu, self.graph.dot(self.graph.geometry("Incoming"), l) - mu * self.view.mu)

    def weight(self, weight: Weight) -> Number:
        """Return c(mu) as a value, or a number where it is the same everywhere; nodes are made once for each weight."""
        if weight not in self._weights:
            self._weights[weight] = self._weight(weight)
        return self._weights[weight]

    def _weight(self, weight: Weight) -> Number:
        constant, *factors = weight
        while factors and factors[-1] == 0.0:
            factors.pop()
        if not factors:
            return constant
        total: Number = factors.pop()
        while factors:
            total = self.graph.multiply_add(self.view.mu, total, factors.pop())
        return self.graph.multiply_add(self.view.sine, total, constant)
