"""Learned movements: networks that are what they should be, that learn, and that move as their examples do."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.motion.learned import dynamics, mixture, recurrent, sequences, structure, training
from handout.motion.learned.sequences import INPUTS, MovementSequence
from handout.networks import Adam, clip_norm, dropout


def network(rng, inputs=4, hidden=(7, 5), outputs=12):
    return [
        layer + rng.normal(0, 0.05, layer.shape).astype(np.float32)
        for layer in recurrent.initial_weights(inputs, hidden, outputs, rng)
    ]


def zigzag(rng, movements=6, ways=9, bend=0.8):
    """Movements whose bends follow their turns, and whose overlaps follow their lengths."""
    parts = []
    for _ in range(movements):
        turn = rng.uniform(0.5, 2.0, ways) * rng.choice([-1, 1], ways)
        length = rng.uniform(0.6, 1.6, ways)
        z = np.concatenate([[0], np.cumsum(length * np.exp(1j * np.cumsum(turn)))]) + 3 * len(parts)
        parts.append((np.column_stack([z.real, z.imag]), turn, length))
    known = sequences.of_targets([xy for xy, _, _ in parts])
    dt = np.concatenate([np.append(0.3 + 0.4 * (length - 0.6), 0.0) for _, _, length in parts])[:-1]
    theta = np.concatenate([np.append(bend * np.sin(turn / 2), 0.0) for _, turn, _ in parts])[:-1]
    return replace(known, dt=np.where(known.starts | known.up, 0.0, dt), theta=theta)


def test_gradients_are_those_of_differences():
    rng = np.random.default_rng(1)
    parameters = [layer.astype(np.float64) for layer in network(rng)]  # type: ignore[misc]
    x, y = rng.normal(size=(6, 3, 4)).astype(np.float32), rng.normal(size=(6, 3, 2))
    known, weight = rng.random((6, 3)) > 0.3, rng.random((6, 3))

    def loss():
        return mixture.loss(recurrent.forward(parameters, x)[0].astype(np.float64), y, known, weight)

    outputs, passes = recurrent.forward(parameters, x)
    gradients = recurrent.backward(parameters, passes, mixture.loss(outputs, y, known, weight)[1])
    for layer, gradient in zip(parameters, gradients, strict=True):
        for at in [tuple(rng.integers(n) for n in layer.shape) for _ in range(6)]:
            was, both = layer[at], []
            for step in (1e-2, -1e-2):
                layer[at] = was + step
                both.append(loss()[0])
            layer[at] = was
            assert gradient[at] == pytest.approx((both[0] - both[1]) / 2e-2, rel=2e-2, abs=2e-3)


def test_step_by_step_is_as_at_once_and_goes_on_from_a_state():
    rng = np.random.default_rng(2)
    parameters = network(rng)
    x = rng.normal(size=(9, 1, 4)).astype(np.float32)
    runner = recurrent.Runner(parameters)
    steps = [runner.step(row) for row in x[:5, 0]]
    kept = runner.state
    steps += [runner.step(row) for row in x[5:, 0]]
    np.testing.assert_allclose(steps, recurrent.forward(parameters, x)[0][:, 0], atol=1e-5)
    runner.state = kept
    np.testing.assert_allclose([runner.step(row) for row in x[5:, 0]], steps[5:], atol=1e-6)


def test_agrees_with_torch():
    torch = pytest.importorskip("torch")
    rng = np.random.default_rng(3)
    parameters = network(rng, 10, (64, 64), 30)
    lstm, linear = torch.nn.LSTM(10, 64, 2), torch.nn.Linear(64, 30)
    with torch.no_grad():
        for k, layer in enumerate(parameters[:-1]):
            before = layer.shape[0] - 65
            for name, part in (
                ("weight_ih", layer[:before].T),
                ("weight_hh", layer[before:-1].T),
                ("bias_ih", layer[-1]),
            ):
                getattr(lstm, f"{name}_l{k}").copy_(torch.from_numpy(np.ascontiguousarray(part)))
            getattr(lstm, f"bias_hh_l{k}").zero_()
        linear.weight.copy_(torch.from_numpy(np.ascontiguousarray(parameters[-1][:-1].T)))
        linear.bias.copy_(torch.from_numpy(parameters[-1][-1]))
    x, y = rng.normal(size=(20, 8, 10)).astype(np.float32), rng.normal(size=(20, 8, 2))
    raw = linear(lstm(torch.from_numpy(x))[0])
    outputs, passes = recurrent.forward(parameters, x)
    np.testing.assert_allclose(outputs, raw.detach().numpy(), atol=1e-5)
    wide, value = raw.double(), torch.from_numpy(y)[:, :, :, None]
    mean, spread = wide[..., 5:15].unflatten(-1, (2, 5)), wide[..., 15:25].unflatten(-1, (2, 5)).exp()
    r, z = 0.999 * wide[..., 25:].tanh(), (value - mean) / spread
    square = z[..., 0, :] ** 2 + z[..., 1, :] ** 2 - 2 * r * z[..., 0, :] * z[..., 1, :]
    log = -square / 2 / (1 - r**2) - (2 * np.pi * spread.prod(2) * (1 - r**2).sqrt()).log()
    cost = -(wide[..., :5].log_softmax(-1) + log).logsumexp(-1).mean()
    cost.backward()
    everywhere = np.ones((20, 8), dtype=bool)
    ours, slopes = mixture.loss(outputs, y, everywhere, everywhere / 160)
    assert ours == pytest.approx(float(cost.detach()), abs=1e-5)
    gradients = recurrent.backward(parameters, passes, slopes)
    np.testing.assert_allclose(gradients[0][:10].T, lstm.weight_ih_l0.grad.numpy(), atol=1e-5)
    np.testing.assert_allclose(gradients[1][-1], lstm.bias_hh_l1.grad.numpy(), atol=1e-5)
    np.testing.assert_allclose(gradients[2][:-1].T, linear.weight.grad.numpy(), atol=1e-5)


@given(st.integers(0, 10**6))
@settings(max_examples=6, deadline=None)
def test_a_density_sums_to_one_and_is_drawn_from(seed):
    rng = np.random.default_rng(seed)
    raw = rng.normal(0, 0.6, 18).astype(np.float32)
    grid = np.linspace(-25, 25, 251)
    places = np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1)
    density = np.exp(mixture.log_density(np.broadcast_to(raw, (251, 251, 18)), places, np.ones((251, 251), bool)))
    assert density.sum() * 0.04 == pytest.approx(1.0, abs=0.02)
    second = np.exp(mixture.log_density(np.broadcast_to(raw, (251, 18)), places[0], np.zeros(251, bool)))
    np.testing.assert_allclose(second, density.sum(axis=0) * 0.2, atol=0.02)
    drawn = np.array([mixture.draw(raw.tolist(), 1.0, rng.random(), tuple(rng.standard_normal(2))) for _ in range(800)])
    mean = (density[..., None] * places).sum(axis=(0, 1)) * 0.04
    spread = np.sqrt((density[..., None] * (places - mean) ** 2).sum(axis=(0, 1)) * 0.04)
    assert np.all(np.abs(drawn.mean(axis=0) - mean) < 5 * spread / np.sqrt(len(drawn)))
    cool = [mixture.draw(raw.tolist(), 1e-4, rng.random(), tuple(rng.standard_normal(2))) for _ in range(20)]
    assert np.ptp(cool, axis=0).max() < 0.3


def test_dropout_clipping_and_adam():
    rng = np.random.default_rng(4)
    mask = dropout((200, 200), 0.25, rng)
    assert set(np.unique(mask).tolist()) == {0.0, np.float32(4 / 3)} and mask.mean() == pytest.approx(1, abs=0.02)
    gradients = [np.full(3, 3.0, np.float32), np.full(4, 4.0, np.float32)]
    norm = clip_norm(gradients, 1.0)
    assert norm == pytest.approx(np.sqrt(27 + 64)) and clip_norm(gradients, 9.0) == pytest.approx(1.0, abs=1e-6)
    x = [np.array([3.0, -2.0], np.float32)]
    adam = Adam(x)
    for _ in range(400):
        adam.step([2 * x[0]], 0.05)
    assert np.abs(x[0]).max() < 0.02


@pytest.mark.parametrize("inputs", INPUTS)
def test_features_do_not_know_place_or_size_and_the_frame_is_local(inputs):
    known = zigzag(np.random.default_rng(5))
    told = sequences.features(*sequences.frame_sequence(known), inputs, np.array(known.unit))
    assert told.shape == (len(known.up), sequences.columns(inputs))
    turned = np.array([[np.cos(0.7), np.sin(0.7)], [-np.sin(0.7), np.cos(0.7)]])
    for factor, turn, same in ((3.0, np.eye(2), True), (1.0, turned, not inputs.startswith("berio"))):
        other = replace(known, targets=factor * known.targets @ turn + 40)
        again = sequences.features(*sequences.frame_sequence(other), inputs, np.array(other.unit))
        assert np.allclose(told, again, atol=1e-6) == same


def test_windows_overlap_by_half_and_hide_what_means_nothing():
    known = zigzag(np.random.default_rng(6))
    n = len(known.up)
    seen = training.windows([known], 10)
    assert len(seen.dt) == -(-(n - 5) // 5) and seen.paper.sum(axis=0)[:5].min() >= 1
    np.testing.assert_allclose(seen.theta[1, 1:11], known.theta[5:15])
    np.testing.assert_array_equal(seen.first[0], known.starts[:10])
    assert not seen.paper[0][known.up[:10]].any()
    two = training.windows([sequences.join_sequences([known, known])], n + 3)
    assert two.there[0, n + 1] == 0 and two.there[0, 1 : n + 1].all()  # examples that are strung together stay apart


def test_variations_stay_movements_and_a_dot_stays_a_dot():
    rng = np.random.default_rng(7)
    known = zigzag(rng, movements=2)
    dotted = MovementSequence(
        np.concatenate([known.targets, [[50.0, 50.0]]]),
        np.append(known.up, True),
        np.append(known.dt, 0),
        np.append(known.theta, 0),
    )
    varied = training.vary(dotted, training.PlanVariation(), rng)
    assert (
        (varied.targets[-1] == 50).all() and (varied.dt[dotted.starts] == 0).all() and not varied.theta[dotted.up].any()
    )
    assert 0 < np.abs(varied.targets - dotted.targets).max() < 0.5 and (varied.up == dotted.up).all()


@pytest.mark.slow
def test_learns_dynamics_and_predicts_them_elsewhere():
    rng = np.random.default_rng(8)
    known, other = zigzag(rng, 12), zigzag(rng, 8)
    recipe = training.NetworkRecipe(steps=100)
    model = dynamics.learn([known], rng, recipe)
    expected, paper = model.predict_means(other), ~other.up
    assert np.corrcoef(expected[paper, 1], other.theta[paper])[0, 1] > 0.9
    told = paper & ~other.starts
    assert np.corrcoef(expected[told, 0], other.dt[told])[0, 1] > 0.6
    straight = zigzag(rng, 8, bend=-0.8)
    assert model.log_densities(other).mean() > model.log_densities(straight).mean() + 1
    state = model.state_after(known)
    cold, warm = (model.predict(other, np.random.default_rng(1), t, state) for t in (0.01, 1.0))
    again = model.predict(other, np.random.default_rng(1), 1.0, state)
    assert (again.theta == warm.theta).all() and np.abs(warm.theta - cold.theta).max() > 0.01
    assert (cold.dt[~told] == 0).all() and (cold.dt[told] >= sequences.LEAST_DT).all() and not cold.theta[~paper].any()


@pytest.mark.slow
def test_invents_structure_like_its_example():
    rng = np.random.default_rng(9)
    stair = np.column_stack([np.repeat(np.arange(5.0), 2)[1:], np.repeat(np.arange(5.0), 2)[:-1]])
    known = sequences.of_targets([stair + np.array([x, 0.0]) for x in (0.0, 6.0, 12.0)])
    model = structure.learn([known], rng, training.NetworkRecipe(steps=120))
    new = model.invent(rng, 0.3)
    ways = np.diff(new.targets, axis=0)[~new.up]
    assert len(new.up) <= 2 * len(known.up)
    assert np.median(np.abs(ways).min(axis=1)) < 0.2 and np.median(ways.max(axis=1)) == pytest.approx(1.0, abs=0.25)
    primed = model.invent(np.random.default_rng(1), 0.3, known)
    assert (primed.targets == model.invent(np.random.default_rng(1), 0.3, known).targets).all() and not primed.up[-1]


def test_the_size_of_the_paper():
    rng = np.random.default_rng(10)
    model = dynamics.learn(
        [zigzag(rng, 3)], rng, training.NetworkRecipe(size="berio_2017", steps=1, batch=2), "berio_2017"
    )
    assert recurrent.sizes(model.parameters) == (400, 400) and model.gaussians == 20
    assert training.SIZES["berio_2017"].dropout == 0.1 and model.parameters[0].shape[0] == 5 + 400 + 1


def test_too_little_is_refused():
    lone = sequences.of_targets([np.zeros((1, 2)), np.ones((2, 2)) * [[0], [1]]])
    for learn in (dynamics.learn, structure.learn):
        with pytest.raises(ValueError, match="fewer than two"):
            learn(
                [sequences.of_targets([lone.targets[1:2]])] if learn is structure.learn else [lone],
                np.random.default_rng(0),
            )
