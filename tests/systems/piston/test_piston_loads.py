"""Side loads of the floating piston: textbook closed forms, multipliers, brute force, balances, gas law, bad input."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import quad

from graphsynth.core.errors import GeometryError
from graphsynth.systems.piston import CrankSlider, FloatingGroup, FloatingPiston, ScotchYoke
from graphsynth.systems.piston.loads import CompressorCycle, ConstantForce, GivenForce, PistonFriction, PistonMasses
from graphsynth.systems.piston.machine import PistonMachine
from graphsynth.systems.piston.turn import compare_pistons, piston_turn
from tests.systems.piston import closed_form

MASSES = PistonMasses(2.0, 1.5, 3.0, 1.0, 0.01, 0.02, 0.01, 0.07)
AIR = CompressorCycle(0.1, suction=1e5, discharge=6e5)
RUB = PistonFriction(guide=0.05, cylinder=0.1, slot=0.08, yoke=0.06, rings=20.0)
ASKEW = FloatingPiston.crank_slider(
    0.05, 0.2, 0.01, cylinder_angle=0.05, slot_angle=1.5, cylinder_offset=0.003, lead=0.1
)
MACHINES = {
    "square": PistonMachine(FloatingPiston.crank_slider(0.05, 0.2), MASSES, AIR, RUB, 100.0),
    "askew": PistonMachine(ASKEW, MASSES, AIR, RUB, 100.0, gravity=(-9.0, 3.0)),
    "backwards": PistonMachine(ASKEW, MASSES, AIR, RUB, -80.0, gravity=(-9.0, 3.0)),
    "accelerated": PistonMachine(ASKEW, MASSES, AIR, RUB, 30.0, 400.0, (0.0, -9.81)),
    "other side": PistonMachine(
        FloatingPiston(CrankSlider(0.05, 0.2, 0.02, branch=-1), FloatingGroup(0.03)), MASSES, AIR, RUB, 60.0
    ),
    "yoke": PistonMachine(
        FloatingPiston(ScotchYoke(0.05, 0.01, 1.4), FloatingGroup(0.05)), MASSES, AIR, RUB, 100.0, gravity=(-9.0, 3.0)
    ),
    "smooth": PistonMachine(ASKEW, MASSES, AIR, speed=100.0),
}


@pytest.mark.parametrize("plain", [False, True], ids=["floating", "plain"])
@pytest.mark.parametrize("machine", MACHINES.values(), ids=MACHINES)
def test_general_dynamics_gives_the_closed_form(machine, plain):
    machine = machine.without_group() if plain else machine
    phi = np.linspace(0.1, 6.1, 9)
    found, exact, stroke = machine.loads(phi), closed_form.loads(machine, phi), machine.mechanism.stroke
    size = np.abs(exact["crank_pin"]).max()
    for name, values in exact.items():
        own = getattr(found, name)
        own = own[:, 0] + 1j * own[:, 1] if own.ndim > 1 else own / (stroke if "couple" in name else 1.0)
        own = own / stroke if name == "torque" else own
        values = values / (stroke if name in ("torque", "guide_couple") else 1.0)
        assert np.abs(own - values).max() < 1e-12 * size, name
    assert found.power_error < 1e-13
    assert np.abs(found.wall).max() > 1.0 or not plain


@pytest.mark.parametrize("machine", MACHINES.values(), ids=MACHINES)
def test_a_sliding_slot_leaves_the_couples_open(machine):
    """The source's sliding pair: the same forces; which couple goes where, nobody can tell."""
    phi = np.linspace(0.1, 6.1, 9)
    own, other = machine.inverse_dynamics(phi), machine.inverse_dynamics(phi, "sliding")
    for pair in ((0, 1), (1, 2), (2, 3), (0, 3), (3, 4), (0, 4)):
        forces = (found.reactions.between(*pair).force for found in (own, other))
        assert np.abs(np.subtract(*forces)).max() < 1e-12 * np.abs(own.reactions.between(1, 2).force).max()
        assert own.reactions.between(*pair).determined.all()
    assert np.abs(own.efforts - other.efforts).max() < 1e-12 * np.abs(own.efforts).max()
    assert not any(other.reactions.between(*pair).determined[:, 2].any() for pair in ((0, 3), (3, 4), (0, 4)))


def brute_force(machine, phi):
    """Equilibrium of all bodies as one linear system for every sign of the normal forces, from finite differences.

    Nothing is taken from the closed form: positions come from the geometry, accelerations from differences of
    positions, friction from its definition.
    """
    drive, group, masses, w = machine.mechanism.drive, machine.mechanism.group, machine.masses, machine.speed
    r, rod, e = drive.crank, drive.rod, drive.offset
    cyl, slot = np.exp(1j * group.cylinder_angle), np.exp(1j * group.slot_angle)

    def places(a):
        A = r * np.exp(1j * a)
        C = A.real + math.sqrt(rod**2 - (A.imag - e) ** 2) + 1j * e
        base = 1j * (e + group.cylinder_offset)
        t, u = np.linalg.solve(
            [[cyl.real, -slot.real], [cyl.imag, -slot.imag]], [(C + group.lead - base).real, (C - base).imag]
        )
        G = A + masses.rod_centre * (C - A) / rod
        return np.array([A, C, base + t * cyl, G, masses.crank_centre * np.exp(1j * a), u, np.angle(C - A)])

    h = 2e-3
    p = [places(phi + k * h) for k in (-2, -1, 0, 1, 2)]
    A, C, _, G, G1, _, _ = p[2]
    v = w * (p[0] - 8 * p[1] + 8 * p[3] - p[4]) / (12 * h)
    acc = w**2 * (-p[0] + 16 * p[1] - 30 * p[2] + 16 * p[3] - p[4]) / (12 * h * h)
    g = complex(*machine.gravity)
    f = machine.friction

    def mu(c, speed):
        return c * math.tanh(speed / f.smoothing_velocity)

    piston_speed, slot_speed = (v[2] * np.conj(cyl)).real, v[5].real
    own = -cyl * (machine.gas_force([phi])[0] + mu(f.rings, piston_speed))
    results = []
    for s3, s4, sw in np.ndindex(2, 2, 2):
        s3, s4, sw = 1 - 2 * s3, 1 - 2 * s4, 1 - 2 * sw
        n3 = 1j - mu(f.guide, v[1].real) * s3
        n34 = 1j * slot - mu(f.slot, slot_speed) * s4 * slot
        n4 = 1j * cyl - mu(f.cylinder, piston_speed) * sw * cyl
        # unknowns: O (2), A (2), C (2), guide, slot, wall, torque
        M, b = np.zeros((10, 10)), np.zeros(10)

        def put(row, column, force, arm=None, M=M):
            M[row, column] += force.real
            M[row + 1, column] += force.imag
            if arm is not None:
                M[row + 2, column] += (np.conj(arm) * force).imag

        for k, unit in enumerate((1.0 + 0j, 1j)):
            put(0, k, unit, -G1)
            put(0, 2 + k, -unit, A - G1)
            put(3, 2 + k, unit, A - G)
            put(3, 4 + k, -unit, C - G)
            put(6, 4 + k, unit)
        M[2, 9] = 1.0
        put(6, 6, n3)
        put(6, 7, -n34)
        put(8, 7, n34)
        put(8, 8, n4)
        right = [masses.crank * (acc[4] - g), masses.follower * (acc[3] - g)]
        b[0:2], b[3:5] = [right[0].real, right[0].imag], [right[1].real, right[1].imag]
        b[5] = masses.rod_inertia * acc[6].real
        for row, value in ((6, masses.crosshead * (acc[1] - g)), (8, masses.piston * (acc[2] - g) - own)):
            b[row : row + 2] = value.real, value.imag
        x = np.linalg.solve(M, b)
        if s3 * x[6] >= 0 and s4 * x[7] >= 0 and sw * x[8] >= 0:
            results.append(x)
    assert len(results) == 1
    return results[0]


@pytest.mark.parametrize("name", ["askew", "backwards", "smooth"])
def test_brute_force_equilibrium(name):
    machine = MACHINES[name]
    for phi in (0.3, 1.2, 2.9, 4.0, 5.5):
        loads, x = machine.loads(phi), brute_force(machine, phi)
        size = np.abs(x[:9]).max()
        found = np.array([*loads.bearing[0], *loads.crank_pin[0], *loads.crosshead_pin[0], loads.guide[0],
                          loads.slot[0], loads.wall[0]])  # fmt: skip
        assert np.abs(found - x[:9]).max() < 1e-8 * size  # differences of the fourth order
        assert abs(loads.torque[0] - x[9]) < 1e-8 * size * 0.05


def test_massless_plain_slider_is_the_textbook():
    """N = F tan(psi), sin(psi) = (r sin(phi) - e) / l, whatever the speed."""
    phi = np.linspace(0.0, 6.2, 63)
    drive = CrankSlider(0.05, 0.2, 0.013)
    machine = PistonMachine(FloatingPiston(drive), gas=ConstantForce(700.0), speed=12.0)
    plain = machine.without_group().loads(phi)
    psi = np.arcsin((0.05 * np.sin(phi) - 0.013) / 0.2)
    assert np.abs(plain.wall - 700.0 * np.tan(psi)).max() < 1e-10
    assert np.abs(np.hypot(*plain.crosshead_pin.T) - 700.0 / np.cos(psi)).max() < 1e-10
    # torque against the gas: T = F ds/dphi
    assert np.abs(plain.torque - 700.0 * machine.mechanism.motion(phi).piston.first).max() < 1e-12
    floating = machine.loads(phi)
    assert np.abs(floating.wall).max() < 1e-12 * 700.0
    assert np.abs(floating.guide - plain.wall).max() < 1e-12 * 700.0  # the side load has moved, not vanished
    assert np.abs(floating.slot + 700.0).max() < 1e-10


@pytest.mark.long
def test_largest_side_load_of_the_plain_machine():
    machine = PistonMachine(FloatingPiston(CrankSlider(0.05, 0.2, 0.01)), gas=ConstantForce(1000.0))
    found = compare_pistons(machine)
    assert found.plain.peak_wall == pytest.approx(1000.0 * 0.06 / math.sqrt(0.04 - 0.0036), rel=1e-9)
    assert found.guide_share == pytest.approx(1.0, rel=1e-9)
    assert found.wall_ratio < 1e-12
    assert found.squareness == pytest.approx(math.asin(0.06 / 0.2), rel=1e-15)


@settings(max_examples=40, deadline=None)
@given(error=st.floats(-0.4, 0.4), turn=st.floats(-0.3, 0.3), phi=st.floats(0.0, 6.28), load=st.floats(1.0, 1e5))
def test_square_error_of_the_slot(error, turn, phi, load):
    """Without masses and friction the wall carries F tan(error), error the missing angle between slot and cylinder."""
    group = FloatingGroup(turn, turn + 0.5 * math.pi + error)
    machine = PistonMachine(FloatingPiston(CrankSlider(0.05, 0.2), group), gas=ConstantForce(load))
    loads = machine.loads(phi)
    assert abs(abs(loads.wall[0]) - load * abs(math.tan(error))) < 1e-11 * load
    assert abs(abs(loads.slot[0]) - load / math.cos(error)) < 1e-11 * load


@pytest.mark.long
def test_break_even_is_the_steepest_angle_of_the_rod():
    plain = PistonMachine(FloatingPiston.crank_slider(0.05, 0.2), gas=ConstantForce(1000.0))
    limit = compare_pistons(plain).squareness
    for factor, better in ((0.99, True), (1.01, False)):
        group = FloatingGroup(slot_angle=0.5 * math.pi + factor * limit)
        found = compare_pistons(replace(plain, mechanism=FloatingPiston(CrankSlider(0.05, 0.2), group)))
        assert (found.wall_ratio < 1.0) is better


@pytest.mark.long
def test_scotch_yoke_presses_with_its_ends():
    """A plain yoke has no side load, but a couple F r sin(phi): the second group takes that from the cylinder."""
    machine = PistonMachine(FloatingPiston.scotch_yoke(0.05), gas=ConstantForce(1000.0))
    phi = np.linspace(0.0, 6.2, 33)
    plain = machine.without_group().loads(phi)
    assert np.abs(plain.wall).max() < 1e-12 * 1000.0
    assert np.abs(np.abs(plain.wall_couple) - 50.0 * np.abs(np.sin(phi))).max() < 1e-11
    assert np.abs(machine.loads(phi).wall_couple).max() == 0.0
    found = compare_pistons(machine, length=0.08)
    assert found.plain.peak_edge == pytest.approx(1000.0 * 0.05 / 0.08, rel=1e-9)
    assert found.edge_ratio < 1e-12
    assert found.guide_share == pytest.approx(1.0, rel=1e-9)
    assert math.isnan(found.wall_ratio)  # a plain yoke has no side load to compare with
    assert math.isnan(found.squareness)
    near, far = plain.edges(0.08)
    assert np.abs(near + far - plain.wall).max() < 1e-12 * 1000.0
    assert np.abs((far - near) * 0.04 - plain.wall_couple).max() < 1e-12 * 50.0


def test_self_stress_balances_every_body():
    on_crosshead, on_piston_slot, on_piston_wall = MACHINES["square"].loads(1.0).self_stress
    assert on_crosshead - on_piston_slot == 0.0  # crosshead: guide and the opposite of the slot's couple
    assert on_piston_slot + on_piston_wall == 0.0


def test_friction_of_a_plain_slider_by_hand():
    machine = PistonMachine(
        FloatingPiston(CrankSlider(0.05, 0.2), None), gas=ConstantForce(1000.0), speed=10.0,
        friction=PistonFriction(cylinder=0.2, rings=30.0, smoothing_velocity=1e-9),
    )  # fmt: skip
    for phi, sense in ((1.0, -1.0), (4.0, 1.0)):  # away from the head, towards it
        t = 0.25 * math.sin(phi)
        tangent = t / math.sqrt(1.0 - t * t)
        # X = 1000 + 30 sense + 0.2 |N| sense drives the piston, N = X tan(psi)
        axial = (1000.0 + 30.0 * sense) / (1.0 - 0.2 * sense * abs(tangent))
        assert machine.loads(phi).wall[0] == pytest.approx(axial * tangent, rel=1e-13)


def test_where_friction_jams_there_is_no_number():
    machine = PistonMachine(
        FloatingPiston(CrankSlider(0.05, 0.0501), None),
        gas=ConstantForce(1000.0),
        friction=PistonFriction(cylinder=0.9),
    )
    loads = machine.loads([0.1, 4.7])
    assert np.isfinite(loads.wall[0])
    assert np.isnan(loads.wall[1])
    assert np.isnan(loads.torque[1])
    with pytest.raises(GeometryError, match=r"the crank angle .* the machine jams"):
        piston_turn(machine)


@pytest.mark.long
def test_static_friction_in_a_slot_that_stands_still():
    square, askew = MACHINES["square"], MACHINES["askew"]
    loads = square.loads(np.linspace(0, 6, 20))
    assert np.abs(loads.held - 0.08 * np.abs(loads.slot)).max() == 0.0
    assert (askew.loads(1.0).held == 0.0).all()
    assert "may add" in compare_pistons(square).statement


@pytest.mark.long
@pytest.mark.parametrize("machine", [m for m in MACHINES.values() if not m.acceleration],
                         ids=[n for n, m in MACHINES.items() if not m.acceleration])  # fmt: skip
def test_energy_over_a_turn(machine):
    for own in (machine, machine.without_group()):
        turn = piston_turn(own)
        assert turn.balance_error < 1e-12
        assert abs(turn.gas - turn.gas_closed_form) < 1e-12 * turn.gas
        assert max(abs(turn.kinetic), abs(turn.weights)) < 1e-11 * turn.gas
        assert turn.friction > 0.0 or own.friction == PistonFriction()


@pytest.mark.long
@pytest.mark.parametrize("slack", [1e-2, 1e-4, 1e-6])
def test_energy_with_a_rod_that_is_hardly_long_enough(slack):
    mechanism = FloatingPiston.crank_slider(0.05, 0.06 * (1.0 + slack), 0.01, cylinder_angle=0.1)
    machine = PistonMachine(
        mechanism, PistonMasses(2.0, 1.0, 1.0, 1.0), AIR, PistonFriction(rings=10.0), speed=30.0
    )  # fmt: skip
    turn = piston_turn(machine)
    assert turn.balance_error < 1e-9
    assert abs(turn.gas - turn.gas_closed_form) < 1e-9 * turn.gas


@pytest.mark.long
def test_works_against_another_quadrature():
    """The trapezoidal rule of a periodic function, with a friction law so soft that few points are enough."""
    machine = replace(MACHINES["askew"], friction=replace(RUB, smoothing_velocity=1.0), gas=ConstantForce(500.0))
    turn = piston_turn(machine)
    count = 20000
    phi = np.arange(count) * 2.0 * math.pi / count
    loads = machine.loads(phi)
    for power, own in ((loads.driving, turn.motor), (loads.friction_power, turn.friction)):
        assert power.mean() * 2.0 * math.pi / machine.speed == pytest.approx(own, rel=1e-7)


@pytest.mark.long
def test_friction_falls_when_the_guide_is_better_than_the_wall():
    found = compare_pistons(MACHINES["square"])
    rings_only = piston_turn(replace(MACHINES["square"].without_group(), friction=PistonFriction(rings=20.0)))
    assert found.friction_ratio < 1.0
    # what remains above the rings is the guide: about half of what the wall took, as the coefficients are
    share = (found.floating.friction - rings_only.friction) / (found.plain.friction - rings_only.friction)
    assert share == pytest.approx(0.5, abs=0.02)
    equal = replace(MACHINES["square"], friction=PistonFriction(guide=0.1, cylinder=0.1))
    assert compare_pistons(equal).friction_ratio == pytest.approx(1.0, rel=1e-9)


def test_indicated_diagram_of_the_compressor():
    gap, stroke = np.linspace(0.0, 0.1, 11), 0.1
    closing, opening = (AIR.pressure(gap, np.full(11, way), stroke) for way in (True, False))
    assert closing[0] == opening[0] == 6e5
    assert closing[-1] == opening[-1] == 1e5
    assert (np.diff(closing) <= 0.0).all()
    for place, way in AIR.kinks(stroke):
        around = np.array([place - 1e-9, place + 1e-9])
        assert np.ptp(AIR.pressure(around, np.full(2, way), stroke)) < 1.0  # continuous
    points = [place for place, _ in AIR.kinks(stroke)]

    def ring(x):
        a, b = (AIR.pressure(np.array([x]), np.array([way]), stroke)[0] for way in (True, False))
        return a - b

    area, _ = quad(ring, 0.0, stroke, points=points, epsabs=1e-6)
    assert AIR.work(stroke) == pytest.approx(area * AIR.area, rel=1e-10)


@pytest.mark.long
@pytest.mark.parametrize("law", [
    CompressorCycle(0.1, 1e5, 1e5), CompressorCycle(0.1, 1e5, 9e6, clearance=0.2), CompressorCycle(0.1, 1e5, 5e5, 0.0),
    CompressorCycle(0.1, 1e5, 5e5, exponent=1.0),
])  # fmt: skip
def test_extreme_compressors(law):
    machine = PistonMachine(FloatingPiston.crank_slider(0.05, 0.2), gas=law, speed=50.0)
    turn = piston_turn(machine)
    assert turn.balance_error < 1e-12
    assert abs(turn.gas - turn.gas_closed_form) < 1e-12 * max(turn.gas, law.suction * law.area * 0.1)


def test_given_force():
    def spring(angle, gap, closing):
        return 200.0 - 1000.0 * gap

    machine = PistonMachine(FloatingPiston.crank_slider(0.05, 0.2), gas=GivenForce(spring), speed=5.0)
    turn = piston_turn(machine)
    assert abs(turn.gas) < 1e-13  # conservative
    assert math.isnan(turn.gas_closed_form)
    assert machine.loads([1.0, 2.0]).power_error < 1e-12


@pytest.mark.long
def test_free_motion_of_the_model():
    """The general dynamics keeps the crank's speed under the motor torque of the closed form."""
    from graphsynth.dynamics import Torque, simulate_dynamics

    machine = PistonMachine(FloatingPiston.crank_slider(0.05, 0.2, cylinder_angle=0.05), MASSES, ConstantForce(300.0),
                            speed=20.0)  # fmt: skip
    motor = Torque(0, 1, lambda t, angle, speed: float(machine.loads(angle).torque[0]))
    model = machine.dynamic_model()
    model = replace(model, elements=(*model.elements, motor), bodies={
        link: replace(body, inertia=max(body.inertia, 1e-9)) for link, body in model.bodies.items()
    })  # fmt: skip
    run = simulate_dynamics(model, np.linspace(0.0, 0.2, 5), keep={(0, 1): 0.5}, keep_rates={(0, 1): 20.0})
    assert run.completed
    assert np.abs(run.poses[:, 1, 2] - 0.5 - 20.0 * run.times).max() < 1e-8


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: PistonMasses(crank=-1.0), "crank = -1.0 must be zero or more"),
        (lambda: PistonFriction(guide=-0.1), "friction guide"),
        (lambda: PistonFriction(smoothing_velocity=0.0), "smoothing_velocity"),
        (lambda: CompressorCycle(0.0, 1e5, 6e5), "bore of the compressor"),
        (lambda: CompressorCycle(0.1, 6e5, 1e5), "below suction"),
        (lambda: ConstantForce(math.nan), "size of the gas force"),
        (lambda: GivenForce(3.0), "not callable"),
        (lambda: PistonMachine("engine"), "is not a FloatingPiston"),
        (lambda: PistonMachine(ASKEW, gas=5.0), "gas = 5.0"),
        (lambda: PistonMachine(ASKEW, speed=math.inf), "speed of the crank"),
        (lambda: piston_turn(PistonMachine(ASKEW, speed=0.0)), "constant speed other than 0"),
        (lambda: piston_turn(MACHINES["accelerated"]), "acceleration = 400"),
        (lambda: compare_pistons(MACHINES["askew"].without_group()), "no second group"),
        (lambda: piston_turn(MACHINES["smooth"], length=-1.0), "length of the piston"),
        (lambda: PistonMachine(ASKEW, gas=GivenForce(lambda a, g, c: g * math.nan)).loads(1.0), "finite number"),
        (lambda: MACHINES["askew"].loads([math.nan]), "angle"),
    ],
)
def test_bad_input_gets_a_sentence(make, sentence):
    with pytest.raises(GeometryError, match=sentence):
        make()
