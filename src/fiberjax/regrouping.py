"""Products, sums and exponents put in the order that costs a GPU least.

Factors that depend on the material alone come together, and so do terms; they are
computed before the directions are known. Numbers come before colors, divisors become
one, exp(a) exp(b) becomes exp2(a log2(e) + b log2(e)), the factor of e in what the
material decides if it can be. This is the algebra of real numbers, not of
rounding: named values are left as they are, and so are values that are used twice.
"""

import math
from collections import Counter
from collections.abc import Iterable

import numpy as np

from fiberjax.expression import MATERIAL, Graph, Node

_EXPONENTIALS = {"exp": 1 / math.log(2), "exp2": 1.0}
"""What an exponent is multiplied by to be one of 2, as a GPU has it."""

_PRODUCTS = ("mul", "div", "neg", *_EXPONENTIALS)
_SUMS = ("add", "sub")


def uses(roots: Iterable[Node]) -> Counter[Node]:
    """How often each node below the roots is an argument, or a root."""
    found = Counter(roots)
    stack = list(found)
    while stack:
        for x in stack.pop().args:
            found[x] += 1
            if found[x] == 1:
                stack.append(x)
    return found


def _multiplied(x: Node) -> bool:
    """Whether it is a product of its own once the material is known."""
    return x.op == "mul" and x.level > MATERIAL


class _Product:
    """constant prod_i base_i^power_i prod_k 2^(factor_k exponent_k)."""

    def __init__(self):
        self.constant = np.float64(1.0)
        self.powers: Counter[Node] = Counter()
        self.exponents: list[tuple[float, Node]] = []


def regrouped(root: Node) -> Node:
    """The root regrouped, and all that it depends on; what is named in its order."""
    regrouping = _Regrouping(uses([root]))
    for node in sorted(regrouping.uses, key=lambda node: node.order):
        if node.op == "named":
            regrouping.of(node)
    return regrouping.of(root)


class _Regrouping:
    """Regroups nodes that are used so often into a graph of its own."""

    def __init__(self, uses: Counter[Node]):
        self.uses = uses
        self._graph = Graph()
        self._done: dict[Node, Node] = {}

    def of(self, node: Node) -> Node:
        """The node regrouped, and all that it depends on."""
        if node not in self._done:
            before, self._graph.section = self._graph.section, node.section
            self._done[node] = self._regrouped(node)
            self._graph.section = before
        return self._done[node]

    def _regrouped(self, node: Node) -> Node:
        if node.op in _PRODUCTS:
            product = _Product()
            self._factors(node, 1, product, self.uses[node])
            return self._product(product)
        if node.op in _SUMS:
            return self._sum([(1, node)], self.uses[node])
        if node.op == "const":
            return self._graph.constant(node.value)
        args = [self.of(x) for x in node.args]
        if node.op in ("named", "call"):
            return getattr(self._graph, node.op)(node.name, *args)
        return self._graph.make(node.op, *args) if args else node

    def _factors(self, x: Node, power: int, into: _Product, once: int = 1) -> None:
        """Collect the factors of x^power; x may be taken apart if used `once`."""
        free = self.uses[x] <= once
        if x.op == "const":
            into.constant = into.constant * x.value**power
        elif free and x.op == "mul":
            twice = 2 if x.args[0] is x.args[1] else 1
            for y in x.args[::twice]:
                self._factors(y, power * twice, into, twice)
        elif free and x.op == "div":
            self._factors(x.args[0], power, into)
            self._factors(x.args[1], -power, into)
        elif free and x.op == "neg":
            into.constant = into.constant * (-1.0) ** power
            self._factors(x.args[0], power, into)
        elif free and x.op in _EXPONENTIALS:
            into.exponents.append((power * _EXPONENTIALS[x.op], x.args[0]))
        else:
            self._regrouped_factor(self.of(x), power, into)

    def _regrouped_factor(self, x: Node, power: int, into: _Product) -> None:
        if x.op == "neg":
            into.constant, x = into.constant * (-1.0) ** power, x.args[0]
        if x.op == "const":
            into.constant = into.constant * x.value**power
        else:
            into.powers[x] += power

    def _product(self, parts: _Product) -> Node:
        graph = self._graph
        # What the material makes of an exponential alone need not be computed again.
        for known in (True, False):
            group = [x for x in parts.exponents if (x[1].level <= MATERIAL) == known]
            if group:
                terms = [term for n, x in group for term in self._scaled(n, x)]
                self._regrouped_factor(graph.make("exp2", self._sum(terms)), 1, parts)
        known = {x: n for x, n in parts.powers.items() if x.level <= MATERIAL}
        rest = {x: n for x, n in parts.powers.items() if x.level > MATERIAL}
        minus = bool(np.all(parts.constant == -1))
        constant = graph.constant(1.0 if minus else parts.constant)
        found = self._quotient(self._quotient(constant, known), rest)
        return graph.make("neg", found) if minus else found

    def _scaled(self, n: float, x: Node, sign: int = 1) -> list[tuple[int, Node]]:
        """n x as terms, each with the factor: it joins those that a term has."""
        if n == 1:
            return [(sign, x)]
        if self.uses[x] <= 1 and x.op in ("add", "sub"):
            other = sign if x.op == "add" else -sign
            first, second = x.args
            return self._scaled(n, first, sign) + self._scaled(n, second, other)
        return [(sign, self._graph.make("mul", self._graph.constant(n), x))]

    def _quotient(self, front: Node, powers: dict[Node, int]) -> Node:
        """front prod_i base_i^power_i, numbers before colors, divided once."""
        graph = self._graph
        over = [(front, 1)] + [(x, n) for x, n in powers.items() if n > 0]
        under = [(x, -n) for x, n in powers.items() if n < 0]
        result = graph.constant(1.0)
        for color in (False, True):
            for x, n in over:
                if x.color == color:
                    result = graph.make("mul", result, graph.power(x, n))
            divisor = graph.constant(1.0)
            for x, n in under:
                if x.color == color:
                    divisor = graph.make("mul", divisor, graph.power(x, n))
            result = graph.make("div", result, divisor)
        return result

    def _terms(self, sign: int, x: Node, into: list, once: int = 1) -> None:
        free = self.uses[x] <= once
        if free and x.op in ("add", "sub"):
            self._terms(sign, x.args[0], into)
            self._terms(sign if x.op == "add" else -sign, x.args[1], into)
        elif free and x.op == "neg":
            self._terms(-sign, x.args[0], into)
        else:
            x = self.of(x)
            minus = x.op == "neg"
            into.append((-sign if minus else sign, x.args[0] if minus else x))

    def _sum(self, signed: Iterable[tuple[int, Node]], once: int = 1) -> Node:
        terms: list[tuple[int, Node]] = []
        for sign, x in signed:
            self._terms(sign, x, terms, once)
        known = [term for term in terms if term[1].level <= MATERIAL]
        rest = [term for term in terms if term[1].level > MATERIAL]
        if not rest:
            return self._added(known)
        if known:
            one = known[0] if len(known) == 1 else (1, self._added(known))
            place = terms.index(known[0])
            rest.insert(sum(term in rest for term in terms[:place]), one)
        return self._added(rest)

    def _added(self, terms: list[tuple[int, Node]]) -> Node:
        """The terms in their order: constants as one, numbers before colors."""
        graph = self._graph
        constant = sum(s * x.value for s, x in terms if x.op == "const")
        if not np.any(constant):
            terms = [term for term in terms if term[1].op != "const"]
            if not terms:
                return graph.constant(0.0)
        else:
            first = next(k for k, (_, x) in enumerate(terms) if x.op == "const")
            sign = -1 if np.all(constant < 0) else 1
            one = (sign, graph.constant(sign * np.asarray(constant)))
            others = [term for term in terms[first:] if term[1].op != "const"]
            terms = [*terms[:first], one, *others]
        numbers = [term for term in terms if not term[1].color]
        colors = [term for term in terms if term[1].color]
        if numbers and colors:
            colors.insert(0, self._one(numbers))
        sign, result = self._one(colors or numbers)
        return result if sign > 0 else graph.make("neg", result)

    def _one(self, terms: list[tuple[int, Node]]) -> tuple[int, Node]:
        """The sum as one term.

        It starts with a plus: a minus would have to be paid; and with no product, if it
        can: each product after it is fused with its addition.
        """
        plus = [k for k, (sign, _) in enumerate(terms) if sign > 0]
        lead = next((k for k in plus if not _multiplied(terms[k][1])), (plus or [0])[0])
        (side, result), *others = terms[lead], *terms[:lead], *terms[lead + 1 :]
        for sign, x in others:
            op = "add" if sign == side else "sub"
            result = self._graph.make(op, result, x)
        return side, result
