"""Solve a dumped program outside of Pilotfish (docs/program.md): python3 solve_dump.py program.json"""

import json
import sys

import clarabel
from scipy.sparse import csc_matrix

with open(sys.argv[1]) as file:
    d = json.load(file)
P, A = (csc_matrix((M["nzval"], M["rowval"], M["colptr"]), (M["m"], M["n"])) for M in (d["P"], d["A"]))
kind = {"zero": clarabel.ZeroConeT, "nonneg": clarabel.NonnegativeConeT, "soc": clarabel.SecondOrderConeT}
cones = [kind[cone["type"]](cone["dim"]) for cone in d["cones"]]
settings = clarabel.DefaultSettings()
settings.verbose = False
answer = clarabel.DefaultSolver(P, d["q"], A, d["b"], cones, settings).solve()
print(answer.status, answer.obj_val, d["solution"]["obj"], [answer.x[i] for i in d["v1"]["columns"]])
