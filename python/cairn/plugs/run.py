"""Disks fall on a floor under the law @NAME@; @NAME@.png shows them at rest, and the history of their deepest overlap."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import cairn as cn

here = Path(__file__).resolve().parent
law = cn.plug(here / "lib@NAME@.so", law="@NAME@", params=[0.4, 0.2])

rock = cn.Material("rock", density=2700.0)
x, y = np.meshgrid(np.arange(8) * 0.11, 0.06 + np.arange(8) * 0.11)
centers = np.column_stack([x.ravel() + 0.01 * (np.arange(64) // 8 % 2), y.ravel()])
scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
scene.add(cn.disks(centers, 0.05, rock), cn.wall(point=(0, 0), normal=(0, 1), material=rock))
scene.add(cn.wall(point=(-0.06, 0), normal=(1, 0), material=rock), cn.wall(point=(0.9, 0), normal=(-1, 0), material=rock))
scene.interact(rock, rock, law)

sim = cn.Simulation(scene, dt=1e-3)
deepest = []
for _ in range(500):
    sim.step()
    deepest.append(max(0.0, -float(np.min(sim.contacts.gap, initial=0.0))))

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4))
for center in sim.bodies.position[:64]:
    left.add_patch(plt.Circle(center, 0.05, ec="k"))
left.set(xlim=(-0.1, 0.95), ylim=(-0.05, 1.0), aspect="equal", xlabel="x [m]", ylabel="y [m]", title="after 0.5 s")
right.plot(np.arange(1, 501) * 1e-3, np.array(deepest) / 0.05)
right.set(xlabel="time [s]", ylabel="deepest overlap / radius [-]")
figure.tight_layout()
figure.savefig(here / "@NAME@.png", dpi=120)
print(here / "@NAME@.png")
