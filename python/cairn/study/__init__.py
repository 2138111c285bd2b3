"""The trade between speed and accuracy, measured: settings against error and CPU time, and the cheapest for an accuracy.

from cairn import study

s = study.run("pile.py", figures=["solid_fraction"])
print(s.recommend(1e-2, of="solid_fraction"))
s.plot("solid_fraction", "pile.png")
"""

from ..names import teach
from .calibration import CalibrationError, GrainLearning
from .figures import SUMMARY as FIGURES
from .pool import TaskError
from .recommend import Recommendation
from .settings import Setting
from .study import Study, run

__all__ = ["FIGURES", "CalibrationError", "GrainLearning", "Recommendation", "Setting", "Study", "TaskError", "run"]

teach(globals(), __all__)
