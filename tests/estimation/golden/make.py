#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes golden.hpp: make.py >golden.hpp, with scipy, numpy, control and slycot from PyPI.

Each gain is computed twice, by SciPy (LAPACK's Schur form) and by python-control with SLICOT's SB02MT/SB02OD; they must agree to 9 digits, or
nothing is written. What the components compute must then agree with these to 8 decimals.
"""
import sys

import control
import numpy as np
import scipy
import scipy.linalg as la
import slycot

cases = []


def sampled(a, b, q, r, h):
    """Van Loan's integrals: what x'Qx + u'Ru sums up to over a period in which u is held."""
    n, m = b.shape
    f = np.zeros((n + m, n + m))
    f[:n, :n], f[:n, n:] = a, b
    grown = la.expm(np.block([[-f.T, la.block_diag(q, r)], [np.zeros_like(f), f]]) * h)
    p, s = grown[n + m :, n + m :], grown[n + m :, n + m :].T @ grown[: n + m, n + m :]
    return p[:n, :n], p[:n, n:], s[:n, :n], s[n:, n:], s[:n, n:]


def agree(name, one, other):
    scale = max(1.0, np.abs(one).max())
    if np.abs(one - other).max() > 1e-9 * scale:
        sys.exit(f"{name}: the two packages differ by {np.abs(one - other).max():g}")


def lqr(name, plant, a, b, q, r, h=0.001):
    if plant == "continuous":
        x = la.solve_continuous_are(a, b, q, r)
        k = la.solve(r, b.T @ x)
        agree(name, k, control.lqr(a, b, q, r, method="slycot")[0])
    elif plant == "discrete":
        x = la.solve_discrete_are(a, b, q, r)
        k = la.solve(r + b.T @ x @ b, b.T @ x @ a)
        agree(name, k, control.dlqr(a, b, q, r, method="slycot")[0])
    else:
        ad, bd, qd, rd, nd = sampled(a, b, q, r, h)
        x = la.solve_discrete_are(ad, bd, qd, rd, s=nd)
        k = la.solve(rd + bd.T @ x @ bd, bd.T @ x @ ad + nd.T)
        agree(name, k, control.dlqr(ad, bd, qd, rd, nd, method="slycot")[0])
    cases.append(("lqr", name, f"plant={plant}", dict(a=a, b=b, q=q, r=r), x, k))


def kalman(name, a, c, qn, rn):
    x = la.solve_discrete_are(a.T, c.T, qn, rn)
    k = x @ c.T @ la.inv(c @ x @ c.T + rn)
    by_slicot = control.dare(a.T, c.T, qn, rn, method="slycot")[0]
    agree(name, x, by_slicot)
    cases.append(("kalman", name, "plant=discrete", dict(a=a, c=c, qn=qn, rn=rn), x, k))


def text(m):
    """A C++ literal of what a load argument takes, a row to a line."""
    return ';"\n       "'.join(",".join(repr(float(v)) for v in row) for row in np.atleast_2d(m))


def main():
    rig = np.array(
        [
            [0, 0, 1, 0],
            [0, 0, 0, 1],
            [0, 39.31361, -0.133629, -0.0534516],
            [0, 88.34686, -0.133629, -0.120118],
        ]
    )
    motor = np.array([[0], [0], [267.2582], [267.2582]])
    lqr("furuta", "sampled", rig, motor, np.diag([4, 40, 0.2, 0.4]), np.array([[200.0]]))
    lqr(
        "furuta_continuous",
        "continuous",
        rig,
        motor,
        np.diag([4, 40, 0.2, 0.4]),
        np.array([[200.0]]),
    )
    cart = la.expm(
        np.array([[0, 1, 0, 0], [0, -0.1, 3, 0], [0, 0, 0, 1], [0, -0.5, 30, 0]]) * 0.001
    )
    lqr(
        "cart_pole",
        "discrete",
        cart,
        np.array([[0], [0.002], [0], [0.005]]),
        np.diag([1, 0.1, 10, 0.1]),
        np.array([[0.1]]),
    )
    lqr(
        "two_inputs",
        "continuous",
        np.array([[0, 1, 0], [-2, -0.3, 1], [0, 0.5, 0.7]]),
        np.array([[0, 0], [1, 0.2], [0, 1]]),
        np.array([[2, 0.1, 0], [0.1, 1, 0], [0, 0, 3.0]]),
        np.array([[1, 0.1], [0.1, 0.5]]),
    )
    random = np.random.default_rng(6)
    a = random.normal(size=(6, 6))
    a *= 1.02 / np.abs(la.eigvals(a)).max()
    lqr("six_states", "discrete", a, random.normal(size=(6, 2)), np.eye(6), np.diag([1.0, 2.0]))
    kalman(
        "position",
        np.array([[1, 0.001], [0, 1]]),
        np.array([[1.0, 0]]),
        np.diag([1e-12, 1e-6]),
        np.array([[1e-6]]),
    )
    kalman(
        "six_by_three",
        a,
        random.normal(size=(3, 6)),
        np.diag([0.1, 0.2, 0.3, 0.1, 0.2, 0.3]),
        np.diag([0.5, 0.1, 0.2]),
    )
    kalman(
        "dependent_noises",
        a,
        random.normal(size=(3, 6)),
        0.1 * np.eye(6),
        np.array([[0.5, 0.1, 0], [0.1, 0.3, 0.05], [0, 0.05, 0.2]]),
    )

    print("// SPDX-License-Identifier: MIT")
    print(
        f"// Made by make.py with scipy {scipy.__version__}, control {control.__version__}, slycot {slycot.__version__}, numpy {np.__version__}. Do not edit."
    )
    print(
        "#pragma once\n\n#include <map>\n#include <string>\n#include <vector>\n\nnamespace golden {\n"
    )
    print(
        "struct Case {\n    const char *component, *name;\n    std::map<std::string, std::string> arguments;\n    int rows, columns;"
    )
    print(
        "    std::vector<double> x;     // the solution of Riccati's equation, row by row\n    std::vector<double> gain;  // row by row\n};\n"
    )
    print("inline const std::vector<Case> cases{")
    for component, name, plant, matrices, x, k in cases:
        rows = lambda m: "{" + ", ".join(repr(float(v)) for v in np.asarray(m).ravel()) + "}"
        arguments = [f'{{"plant", "{plant[6:]}"}}'] + [
            f'{{"{n}", "{text(m)}"}}' for n, m in matrices.items()
        ]
        print(
            f'    {{"{component}", "{name}",\n     {{'
            + ",\n      ".join(arguments)
            + f"}},\n     {k.shape[0]}, {k.shape[1]},"
        )
        line = "     "
        for values in (rows(x), rows(k)):
            for piece in values.split(" "):
                if len(line) + len(piece) > 138:
                    print(line.rstrip())
                    line = "      "
                line += piece + " "
            line = line.rstrip() + (", " if values is not None and values == rows(x) else "")
        print(line.rstrip() + "},")
    print("};\n\n}  // namespace golden")


if __name__ == "__main__":
    main()
