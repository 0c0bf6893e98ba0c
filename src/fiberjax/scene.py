"""Leave out what a scene does not need: say what it is, get the smallest evaluator.

scene = Scene(eta=1.55, beta_m=.3, beta_n=.2, sigma_a=(1, 4), tolerance=1e-3)
print(plan(scene))
"""

from fiberjax.planning import plan as plan
from fiberjax.plans import Plan as Plan
from fiberjax.plans import Row as Row
from fiberjax.scenes import Scene as Scene
