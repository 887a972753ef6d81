"""Train a policy to change lanes by PPO, in NumPy: `python train_ppo.py`.

Schulman et al., arXiv:1707.06347. Writes `policy.npz`, which `make` turns into a
planner (`--planner train_ppo:make`), and the learning curve `curve.csv` and
`curve.svg`.
"""

import argparse
import csv
import sys
from pathlib import Path

import gymnasium
import numpy as np
import rearview.gym as driving

# The blocked lane begins 200 m ahead, so that an episode takes 20 s instead of 60.
ROAD = {"traffic.density": "light", "ego.start_m": 600, "ego.goal_m": 900}
TRAINING, VALIDATION = range(800), range(800, 830)
REPEAT = 10  # steps that an action is driven for: one decision a second
ASKING = 0.2  # cost of a decision for another lane, so that it is made where it pays
N_LANES, N_SPEEDS = 3, 5
HALF_LANE = 1.75  # [m]
HIDDEN = 48
BATCH, PASSES, PART = 512, 8, 128  # decisions of an update, passes, of a gradient
DISCOUNT, LAMBDA, CLIP = 0.97, 0.95, 0.2
RATE, ENTROPY = 2e-3, 0.02  # both fall to 0 over the training


def features(observation):
    """Return what the policy looks at: ego, lanes, and the gaps in each lane, (23,)."""
    bodies = observation["vehicles"][observation["mask"] > 0.0]
    ahead, left = 120.0 * bodies[:, 0], 30.0 * bodies[:, 1]
    half = 10.0 * bodies[:, 6]
    found = [*observation["ego"][:5], *observation["lanes"].ravel()]
    for offset in 10.0 * observation["lanes"][:, 1]:
        inside = np.abs(left - offset) < HALF_LANE
        for side in (1.0, -1.0):
            of = np.flatnonzero(inside & (side * ahead > 0.0))
            gaps = np.clip((side * ahead[of] - half[of]) / 120.0, 0.0, 1.0)
            nearest = int(gaps.argmin()) if of.size else None
            found.append(1.0 if nearest is None else gaps[nearest])
            found.append(0.0 if nearest is None else bodies[of[nearest], 2])
    return np.array(found)


class Network:
    """Two layers of tanh; heads for lane, speed and value."""

    def __init__(self, weights):
        self.weights = weights

    @classmethod
    def random(cls, generator, n_inputs):
        """Begin with small random heads, so that all actions are about as likely."""
        sizes = [(n_inputs, HIDDEN), (HIDDEN, HIDDEN), (HIDDEN, N_LANES + N_SPEEDS + 1)]
        weights = []
        for k, (n, m) in enumerate(sizes):
            scale = 0.01 if k == len(sizes) - 1 else 1.0 / np.sqrt(n)
            weights += [scale * generator.standard_normal((n, m)), np.zeros(m)]
        return cls(weights)

    def forward(self, x):
        """Return the layers and the logits of lane and speed, and the value."""
        a, b, c, d, e, f = self.weights
        first = np.tanh(x @ a + b)
        second = np.tanh(first @ c + d)
        out = second @ e + f
        return first, second, (out[:, :N_LANES], out[:, N_LANES:-1], out[:, -1])

    def gradients(self, x, first, second, d_out):
        """Return the gradients of the weights from that of the last layer."""
        _, _, c, _, e, _ = self.weights
        d_second = (d_out @ e.T) * (1.0 - second**2)
        d_first = (d_second @ c.T) * (1.0 - first**2)
        return [
            *(x.T @ d_first, d_first.sum(0)),
            *(first.T @ d_second, d_second.sum(0)),
            *(second.T @ d_out, d_out.sum(0)),
        ]

    def best(self, x):
        """Return the most probable action of one observation."""
        _, _, (lanes, speeds, _) = self.forward(x[None])
        return np.array([lanes[0].argmax(), speeds[0].argmax()])


def probabilities(logits):
    """Return the softmax of each row."""
    raised = np.exp(logits - logits.max(1, keepdims=True))
    return raised / raised.sum(1, keepdims=True)


class Adam:
    """Kingma and Ba, arXiv:1412.6980."""

    def __init__(self, weights):
        self.mean = [np.zeros_like(w) for w in weights]
        self.square = [np.zeros_like(w) for w in weights]
        self.count = 0

    def step(self, weights, gradients, rate):
        """Change the weights in place."""
        self.count += 1
        norm = np.sqrt(sum(float((g**2).sum()) for g in gradients))
        for w, g, m, v in zip(weights, gradients, self.mean, self.square, strict=True):
            shortened = g * min(1.0, 0.5 / max(norm, 1e-12))
            m[:] += 0.1 * (shortened - m)
            v[:] += 0.001 * (shortened**2 - v)
            unbiased = m / (1.0 - 0.9**self.count)
            spread = np.sqrt(v / (1.0 - 0.999**self.count))
            w[:] -= rate * unbiased / (spread + 1e-8)


def collect(env, network, generator, state):
    """Drive BATCH decisions by sampled actions.

    Returns:
        Arrays of the batch, outcomes of the episodes that ended, and where to go on.
    """
    rows, outcomes = [], []
    x = state if state is not None else features(env.reset()[0])
    for _ in range(BATCH):
        _, _, (lanes, speeds, value) = network.forward(x[None])
        chances = probabilities(lanes)[0], probabilities(speeds)[0]
        action = np.array([generator.choice(len(p), p=p) for p in chances])
        chance = chances[0][action[0]] * chances[1][action[1]]
        seen, reward, terminated, truncated, info = env.step(action)
        reward -= ASKING * (action[0] != 1)
        ended = terminated or truncated
        rows.append((x, action, np.log(chance), value[0], reward, ended))
        if ended:
            outcomes.append(info["is_success"])
        x = features(env.reset()[0] if ended else seen)
    last = network.forward(x[None])[2][2][0]
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return columns, last, outcomes, x


def advantages(values, rewards, ended, last):
    """Return generalised advantages, (n,)."""
    found, running = np.zeros(len(values)), 0.0
    for k in range(len(values) - 1, -1, -1):
        goes_on = 1.0 - ended[k]
        delta = rewards[k] + DISCOUNT * goes_on * last - values[k]
        running = delta + DISCOUNT * LAMBDA * goes_on * running
        found[k], last = running, values[k]
    return found


def d_logits(logits, chosen, weight, entropy):
    """Return the gradient of -weight · log p(chosen) - entropy · H by the logits."""
    p = probabilities(logits)
    log = np.log(p + 1e-12)
    spread = -(p * log).sum(1, keepdims=True)
    one = np.eye(p.shape[1])[chosen]
    return -weight[:, None] * (one - p) + entropy * p * (log + spread)


def update(network, optimiser, columns, last, generator, left):
    """Improve the network by a batch; `left` is the share of training that is left."""
    x, actions, old, values, rewards, ended = columns
    gain = advantages(values, rewards, ended, last)
    targets = gain + values
    gain = (gain - gain.mean()) / (gain.std() + 1e-8)
    for _ in range(PASSES):
        for part in np.split(generator.permutation(len(x)), len(x) // PART):
            first, second, (lanes, speeds, value) = network.forward(x[part])
            rows, (lane, speed) = np.arange(PART), actions[part].T
            chance = (
                probabilities(lanes)[rows, lane] * probabilities(speeds)[rows, speed]
            )
            ratio = chance / np.exp(old[part])
            a = gain[part]
            clipped = (ratio > 1.0 + CLIP) & (a > 0.0) | (ratio < 1.0 - CLIP) & (
                a < 0.0
            )
            weight = np.where(clipped, 0.0, a * ratio) / PART
            entropy = ENTROPY * left / PART
            d_out = np.hstack(
                [
                    d_logits(lanes, lane, weight, entropy),
                    d_logits(speeds, speed, weight, entropy),
                    (0.5 * (value - targets[part]) / PART)[:, None],
                ]
            )
            gradients = network.gradients(x[part], first, second, d_out)
            optimiser.step(network.weights, gradients, RATE * left)


def success(env, network, seeds):
    """Return the share of seeds on which the best actions arrive."""
    arrived = 0
    for seed in seeds:
        seen, _ = env.reset(seed=seed)
        ended = False
        while not ended:
            seen, _, terminated, truncated, info = env.step(
                network.best(features(seen))
            )
            ended = terminated or truncated
        arrived += info["is_success"]
    return arrived / len(seeds)


def train(updates, seed, report):
    """Train; returns the network that did best on the validation seeds."""
    generator = np.random.default_rng(seed)
    env = gymnasium.make(
        "rearview/LaneChange-v0", changes=ROAD, repeat=REPEAT, seeds=TRAINING
    )
    seen, _ = env.reset(seed=seed)
    state = features(seen)
    network = Network.random(generator, state.size)
    optimiser = Adam(network.weights)
    best, kept = -1.0, network.weights
    for k in range(updates):
        columns, last, outcomes, state = collect(env, network, generator, state)
        update(network, optimiser, columns, last, generator, 1.0 - k / updates)
        sampled = float(np.mean(outcomes)) if outcomes else float("nan")
        validated = float("nan")
        if (k + 1) % 5 == 0 or k + 1 == updates:
            validated = success(env, network, VALIDATION)
            state = features(env.reset()[0])
            if validated >= best:
                best, kept = validated, [w.copy() for w in network.weights]
        report((k + 1) * BATCH, sampled, validated, float(columns[4].sum()))
    env.close()
    return Network(kept)


def draw(rows, file):
    """Draw the learning curve."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.2), layout="constrained")
    axes = figure.add_subplot()
    decisions, sampled, validated = (
        np.array(c) for c in list(zip(*rows, strict=True))[:3]
    )
    axes.plot(decisions, 100 * sampled, label="sampled actions, training seeds")
    known = ~np.isnan(validated)
    words = f"best action, {len(VALIDATION)} other seeds"
    axes.plot(decisions[known], 100 * validated[known], "o-", label=words)
    axes.set(xlabel="decisions", ylabel="episodes that arrive [%]", ylim=(0, 102))
    axes.legend(loc="lower right")
    figure.savefig(file)


def make(file="policy.npz"):
    """Make a planner of a trained policy; raises as the file does."""
    with np.load(file) as saved:
        network = Network([saved[name] for name in sorted(saved.files)])
    return driving.PolicyPlanner(
        lambda seen: network.best(features(seen)), repeat=REPEAT
    )


def main():
    """Train and write the policy and its curve."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--updates", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("policy.npz"))
    options = parser.parse_args()
    rows = []

    def report(*row):
        rows.append(row)
        sys.stderr.write(
            f"{row[0]} decisions: {row[1]:.2f} sampled, {row[2]:.2f} best\n"
        )

    network = train(options.updates, options.seed, report)
    arrays = {f"w{k}": w for k, w in enumerate(network.weights)}
    np.savez(options.out, **arrays)
    with options.out.with_name("curve.csv").open("w", newline="") as file:
        csv.writer(file).writerows([("decisions", "sampled", "best", "reward"), *rows])
    draw(rows, options.out.with_name("curve.svg"))


if __name__ == "__main__":
    main()
