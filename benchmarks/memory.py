"""Bytes that a body and a contact cost, as Cairn counts its arrays and as the operating system counts the process.

    script/bench memory [--count 50000]
"""

import argparse
import csv
import sys

from cairn.run.views import core_of
from scenes import deposit


def resident():
    """Resident bytes of this process."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def measure(case, count):
    """A row: bytes by Cairn's own count, and growth of the process."""
    before = resident()
    sim = deposit(case, count, max_iter=20, steps=3)
    bodies, contacts = core_of(sim).bytes()
    return {"case": case, "bodies": len(sim.bodies), "contacts": len(sim.contacts),
            "bytes_per_body": round(bodies / len(sim.bodies), 1), "bytes_per_contact": round(contacts / len(sim.contacts), 1),
            "process_growth_mb": round((resident() - before) / 1e6, 1), "counted_mb": round((bodies + contacts) / 1e6, 1)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=50000)
    options = parser.parse_args()
    rows = [measure(case, options.count) for case in ("disks", "spheres")]
    writer = csv.DictWriter(sys.stdout, rows[0])
    writer.writeheader()
    writer.writerows(rows)


if __name__ == "__main__":
    main()
