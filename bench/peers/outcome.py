"""Load steps that are halved where a peer does not converge, and the line of JSON in which a peer reports."""
import json
import time


class Stepper:
    """Steps to 1; a step that fails is halved, four good ones double it again, up to the first size. CPU time counts from `start`."""

    def __init__(self, steps, limit, start):
        self.size = self.largest = 1.0 / steps
        self.limit, self.start = limit, start
        self.level, self.steps, self.iterations, self.failed = 0.0, 0, 0, ""

    def cpu(self):
        return time.process_time() - self.start

    def run(self, attempt):
        good = cuts = 0
        while self.level < 1 - 1e-12:
            if self.cpu() > self.limit:
                self.failed = f"CPU limit of {self.limit:g} s at {100 * self.level:.0f} % of the load"
                return
            level = min(1.0, self.level + self.size)
            converged, iterations = attempt(level)
            self.iterations += iterations
            if converged:
                self.level, self.steps, good = level, self.steps + 1, good + 1
                if good >= 4 and self.size < self.largest:
                    self.size, good = 2 * self.size, 0
            else:
                self.size, good, cuts = self.size / 2, 0, cuts + 1
                if cuts > 16 or self.size < 1e-6:
                    self.failed = f"no convergence at {100 * self.level:.0f} % of the load"
                    return


def report(grid, values, stepper, unknowns, cpu=None):
    found = {name: value for (name, *_), value in zip(grid.monitors, values)}
    print("JSON " + json.dumps({"values": found, "steps": stepper.steps, "iterations": stepper.iterations, "failed": stepper.failed, "unknowns": unknowns,
                                "mesh": f"{grid.nx}x{grid.ny}", "cpu": round(cpu if cpu is not None else stepper.cpu(), 3)}), flush=True)
