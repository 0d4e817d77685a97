"""A psychophysics staircase: the just noticeable difference (JND) of friction.

    python friction_jnd.py                  # a simulated observer on the virtual arm
    python friction_jnd.py --device usb     # a person on an arm, who answers by keys

Each trial has two strokes over level ground, one with the reference's coefficient of friction and
one with a larger one, in random order; the observer says which had more. Two right answers in a row
make the difference smaller by a factor, a wrong one makes it larger again (2-down-1-up): it settles
where two right answers are as likely as not, which is 70.7 % for each. The JND is the geometric mean
of the last reversals, and its Weber fraction is the JND over the reference.

The simulated observer judges a stroke by the mean ratio of the force along the surface to the force
across it while the proxy slides, with normal noise of NOISE in each stroke. So its threshold is known
before: the difference at which a normal variable of deviation sqrt(2) NOISE is right in 70.7 %.
"""

import argparse
import statistics

import numpy as np

import hapterra

REFERENCE = 0.4
#: Standard deviation of the simulated observer's perceived coefficient of friction. An assumption.
NOISE = 0.03
#: The first and the largest difference, the factor of a step, and reversals left out of the mean.
FIRST, LARGEST, STEP, LEFT_OUT = 0.2, 1.0, 1.26, 4
#: The share of right answers to which 2-down-1-up converges.
SETTLES_AT = 0.5**0.5


def staircase(judge, trials, random):
    """Runs the staircase. ``judge(first, second)`` returns the stroke with more friction, 1 or 2.

    Returns the differences of all trials, and those at which the direction reversed.
    """
    difference, differences, reversals, in_a_row, direction = FIRST, [], [], 0, -1
    for _ in range(trials):
        differences.append(difference)
        is_first = bool(random.integers(2))
        pair = (REFERENCE + difference, REFERENCE)
        answer = judge(*(pair if is_first else pair[::-1]))
        in_a_row = in_a_row + 1 if answer == (1 if is_first else 2) else 0
        if 0 < in_a_row < 2:
            continue
        turn, in_a_row = (-1 if in_a_row else 1), 0
        if turn != direction:
            reversals.append(difference)
        direction = turn
        difference = min(difference * STEP**turn, LARGEST)
    return differences, reversals


def jnd_of(reversals):
    """Returns the JND: the geometric mean of equally many upper and lower reversals after the
    first."""
    if len(reversals) < LEFT_OUT + 2:
        raise SystemExit(f"only {len(reversals)} reversals: use more --trials")
    return statistics.geometric_mean(reversals[LEFT_OUT + len(reversals) % 2 :])


def own_threshold():
    """Returns the difference at which the simulated observer is right in 70.7 % of the trials."""
    return 2**0.5 * NOISE * statistics.NormalDist().inv_cdf(SETTLES_AT)


def level_ground():
    """Returns level ground of 100 mm by 100 mm."""
    return hapterra.Terrain(np.zeros((101, 101)), cell_mm=1.0)


def simulated(random):
    """Returns the function by which the observer on the virtual arm judges."""
    ground, arm = level_ground(), hapterra.VirtualArm(home_mm=(50, 50, 10))
    # From above, down to press with about 1 N, 40 mm eastward, and up again.
    corners = [(30, 50, 5), (30, 50, -5), (70, 50, -5), (70, 50, 5)]
    t = np.arange(0, 0.9, 0.001)
    targets = np.column_stack([np.interp(t, [0.0, 0.2, 0.7, 0.9], axis) for axis in zip(*corners)])

    def perceived(friction):
        contact = hapterra.Contact(ground, hapterra.Surface(friction=friction))
        steps = arm.run(contact, targets)
        along, across = -steps["force_n"][:, 0], steps["force_n"][:, 2]
        slides = (across > 0.1) & (np.gradient(steps["proxy_mm"][:, 0]) > 0.01)
        return np.mean(along[slides] / across[slides]) + random.normal(0, NOISE)

    return lambda first, second: 1 if perceived(first) > perceived(second) else 2


def person(device):
    """Returns the function by which a person on an arm with level ground judges. The texts on the
    screen, and the marks, do not reveal the stroke with more friction."""

    def feels(number, friction):
        """Renders a stroke for the person. Returns True if the arm was armed to its end."""
        if not device.is_armed:
            device.arm()
        device.params.friction = friction
        device.mark(f"stroke {number}")
        input(f"Stroke the surface, then press Enter ({number} of 2). ")
        # A released dead-man switch is a fault, which only arm() clears.
        return device.is_armed

    def judge(first, second):
        while not (feels(1, first) and feels(2, second)):
            device.mark("repeated")
            print("The force was lost: repeat from the first stroke.")
        answer = ""
        while answer not in ("1", "2"):
            answer = input("Which had more friction, 1 or 2? ").strip()
        device.mark(f"answer {answer}")
        return int(answer)

    return judge


def plot(differences, jnd, path):
    """Draws the staircase."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
    axes.semilogy(np.arange(1, len(differences) + 1), differences, "o-", ms=3, lw=1)
    axes.axhline(jnd, color="C1", label=f"JND {jnd:.3f}")
    axes.set(xlabel="trial", ylabel=f"difference from {REFERENCE:g}")
    axes.legend()
    figure.savefig(path, dpi=150)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--device", help="usb, usb:SERIAL, tcp:HOST:PORT: a person answers")
    parser.add_argument("--trials", type=int, default=80)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", default="friction_jnd.png")
    given = parser.parse_args()
    random = np.random.default_rng(given.seed)
    if given.device is None:
        differences, reversals = staircase(simulated(random), given.trials, random)
        print(f"the observer's own threshold: {own_threshold():.4f}")
    else:
        with hapterra.connect(given.device, record="friction_jnd.csv", quiet=True) as device:
            device.load(level_ground(), hapterra.Surface(friction=REFERENCE))
            device.arm()
            differences, reversals = staircase(person(device), given.trials, random)
    jnd = jnd_of(reversals)
    print(f"JND {jnd:.4f}, Weber fraction {jnd / REFERENCE:.3f}, of {len(reversals)} reversals")
    plot(differences, jnd, given.out)


if __name__ == "__main__":
    main()
