"""Reference problems G1, G2, G3 of theory/planar-dynamics 9 (36-digit extrapolation), and the seven-body benchmark."""

import numpy as np
import pytest
from dynamic_models import braider, g1, g2, g3, seven_body, seven_pose

from graphsynth.dynamics import consistent_start, inverse_dynamics, simulate_dynamics
from graphsynth.kinematics.simulation import simulate

FORMS = ("one-coordinate", "augmented", "partitioned")

#: t, theta, omega, work
G1 = [
    (0.5, 4.623423440643968469, 17.036183226009738297, 0.0), (1.0, 8.635008170644145574, 7.380399528274997613, 0.0),
    (1.5, 14.048695183448664971, 4.839335749694887890, 0.0), (2.0, 19.151183313715786848, 13.058518322326194277, 0.0),
]  # fmt: skip
G2 = [
    (0.5, -0.4820936818064389423, -1.8394968373026688996, -0.2537602386626932831),
    (1.0, -1.0910217916636493488, 1.4005291616049506360, -0.5826326230989295811),
    (1.5, -0.3717181757833092533, 0.3377285854761060621, -0.2444962629767582897),
    (2.0, -0.7917498324696702080, -1.6378292192204603533, -0.4661556306002227733),
]
G3 = [
    (0.25, 0.9331749819915449920, -7.5351783045200921772, -0.4055640970157782824),
    (0.50, -1.3251664075666814807, -4.7210354883277563747, -0.8168880081231451991),
    (0.75, -0.4898536285232249318, -1.3079913830451850771, -1.0342468437747791689),
    (1.00, -1.0888701292692096897, 3.2648470010506167361, -1.1582648019715075357),
]

PROBLEMS = {
    "G1": (g1, {"keep": {(0, 1): 0.0}, "keep_rates": {(0, 1): 10.0}}, G1),
    "G2": (g2, {"keep": {(0, 1): 0.0}}, G2),
    "G3": (g3, {"keep": {(0, 1): 0.5}, "keep_rates": {(0, 1): 15.0}}, G3),
}


def start_of(name):
    make, options, _ = PROBLEMS[name]
    return consistent_start(make(), modes={0: 1}, **options)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", PROBLEMS)
def test_tables_to_the_printed_digits(name, form):
    make, _, table = PROBLEMS[name]
    times = [0.0, *(row[0] for row in table)]
    motion = simulate_dynamics(make(), times, start=start_of(name), form=form, rtol=2.3e-14, outputs="exact")
    assert motion.completed and motion.warnings == ()
    allowed = 2e-11
    for k, (_, theta, omega, work) in enumerate(table, 1):
        assert abs(motion.poses[k, 1, 2] - theta) < allowed
        assert abs(motion.velocities[k, 1, 2] - omega) < 10.0 * allowed
        assert abs(motion.work[k] - work) < allowed


@pytest.mark.parametrize(
    ("name", "energy", "alpha"),
    [
        ("G1", 3.09661152711577252696, 91.99408159207913565333),
        ("G2", 1.96409966368430366891, -4.58787993673644754354),
        # the slider's weight at y = 0.02 m, a constant, is not in the spec's figure
        ("G3", 1.06886901384970464037 + 0.8 * 9.81 * 0.02, -240.43360483325188694602),
    ],
)
def test_energy_and_acceleration_at_the_start(name, energy, alpha):
    start = start_of(name)
    motion = simulate_dynamics(PROBLEMS[name][0](), [0.0], start=start)
    assert abs(motion.energy[0] / energy - 1.0) < 1e-14
    assert abs(start.accelerations[1, 2] / alpha - 1.0) < 1e-11


@pytest.mark.parametrize(
    ("name", "forces"),
    [
        ("G1", {
            (0, 1): (-16.78359009029937, 1.59429387728051), (1, 2): (-14.78359009029937, -2.20758775456109),
            (2, 3): (-3.75994298490391, -11.22243690960368), (0, 3): (0.41084491464028, 13.55257308261560),
        }),
        ("G3", {
            (0, 1): (-6.95153583574720, -3.72988344408130), (1, 2): (-6.12967517645113, -2.50317259328075),
            (2, 3): (-1.30308916595209, 0.56360453372042), (0, 3): (0.0, 7.28439546627948),
        }),
    ],
)  # fmt: skip
def test_reactions_at_the_start(name, forces):
    motion = simulate_dynamics(PROBLEMS[name][0](), [0.0], start=start_of(name))
    for (a, b), force in forces.items():
        found = motion.reactions.between(a, b)
        assert found.determined.all()
        assert np.abs(found.on(b)[0][0] - force).max() < 3e-13
        assert np.abs(found.on(a)[0][0] + force).max() < 3e-13


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", PROBLEMS)
def test_checks_at_the_default_tolerance(name, form):
    times = np.linspace(0.0, PROBLEMS[name][2][-1][0], 41)
    motion = simulate_dynamics(PROBLEMS[name][0](), times, start=start_of(name), form=form)
    checks = motion.checks
    assert motion.completed and motion.warnings == ()
    assert checks.energy < 1e-9
    assert checks.position_drift < 1e-13 and checks.velocity_drift < 1e-12
    assert checks.power < 1e-13 and checks.dalembert < 1e-13
    assert checks.second_form < 1e-12 and checks.newton_euler < 1e-12
    assert abs(checks.projection_loss) < 1e-10


def test_projection_ends_the_drift():
    """theory/planar-dynamics 5: the closure gap grows without projection and is rounding with it."""
    gaps = [
        simulate_dynamics(
            g1(), [0.0, 2.0], start=start_of("G1"), form="augmented", rtol=1e-6, project=flag
        ).checks.position_drift
        for flag in (False, True)
    ]
    assert gaps[0] > 1e-9 and gaps[1] < 1e-15


def test_error_estimate_bounds_the_error():
    times = [0.0, *(row[0] for row in G1)]
    motion = simulate_dynamics(g1(), times, start=start_of("G1"), rtol=1e-8, estimate_error=True)
    error = np.abs(motion.poses[1:, 1, 2] - [row[1] for row in G1])
    assert error.max() > 1e-9  # the tolerance is not the error
    assert (error < 2.0 * motion.error_estimate[1:]).all()


#: Published solution at t = 0.03 of the seven-body mechanism, test set for initial value problem solvers.
SEVEN = [
    15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
    0.5347301163226948,
    1.048080741042263,
]  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_seven_body_mechanism(form):
    model = seven_body()
    start = consistent_start(model, pose=seven_pose())
    assert start.position_correction < 1e-14 and start.freedom == 1
    motion = simulate_dynamics(model, [0.0, 0.03], start=start, form=form, rtol=1e-13)
    th = motion.poses[-1, :, 2]
    angles = [th[1], th[2] - th[1], th[3], th[4] - th[5], th[5], th[6] - th[7], th[7]]
    assert np.abs(np.array(angles) / SEVEN - 1.0).max() < 1e-9
    assert motion.checks.second_form < 1e-12 and motion.checks.newton_euler < 1e-12


#: theory/braider 7 at w = 1.803 rad/s: F01, F12, F23, F03, T.
BRAIDER = {
    0: (-0.006639487131696429, -0.003951007279825856, -0.006151865781696429, -0.003951007279825856,
        -0.002128989644196429, -0.003536324300019061, -0.01051207169116947, -0.01275680216780750,
        -7.902014559651712e-5),
    45: (-0.004839456837046956, -0.002393107550719340, -0.004494656473810618, -0.002048307187483002,
         -0.001587080396653594, -0.001288624539887025, -0.01239058303943027, -0.01344872162838316,
         3.459660339026256e-5),
    135: (0.002024364675765324, -0.0008553838129811615, 0.001679564312528985, -0.0005105834497448226,
          -6.792441418579340e-5, 0.0008535545735178835, -0.0006768885670919429, -0.02044936499705392,
          -1.653188590303964e-5),
    270: (0.001338911135500051, 0.003160774210507176, 0.001338911135500051, 0.002673152860507176,
          0.0003721566695955627, 0.0006719076386618246, 0.003833814502027482, -0.01955013316099112,
          2.677822271000102e-5),
}  # fmt: skip
FAST = {
    45: (-48.39456837046956, -23.93107550719340, -44.94656473810618, -20.48307187483002, -15.87080396653594,
         -12.88624539887025, 9.144111795725163, 10.13573543564782, 0.3459660339026256),
    270: (13.38911135500051, 31.60774210507176, 13.38911135500051, 26.73152860507176, 3.721566695955627,
          6.719076386618246, -1.575307172379855, -3.082513364685191, 0.2677822271000102),
}  # fmt: skip


@pytest.mark.parametrize(("speed", "table"), [(1.803, BRAIDER), (180.3, FAST)])
def test_inverse_dynamics_of_the_braider(speed, table):
    """Cases of theory/braider 7, the second where inertia dominates (case 17 of theory/extreme-cases 3)."""
    model = braider()
    motion = simulate(model.mechanism, np.radians(sorted(table)), modes={0: 1})
    found = inverse_dynamics(model, motion, speed)
    for k, angle in enumerate(sorted(table)):
        row = np.concatenate(
            [found.reactions.between(*pair).on(pair[1])[0][k] for pair in ((0, 1), (1, 2), (2, 3), (0, 3))]
        )
        size = np.abs(table[angle][:8]).max()
        assert np.abs(row - table[angle][:8]).max() < 1e-13 * size
        assert abs(found.efforts[k, 0] - table[angle][8]) < 1e-13 * size
    assert found.power_error < 1e-13 and found.newton_euler < 1e-12
