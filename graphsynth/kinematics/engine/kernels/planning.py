"""From a drawn mechanism to its program: which joints and links each step works on, and the numbers of its rows."""

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import cos, hypot, sin
from graphsynth.kinematics.engine import codes, outlines
from graphsynth.structure.pebbles import SOUND, divide

#: Columns of the numbers of a joint.
AX, AY, A_ANGLE, BX, BY, B_ANGLE, RADIUS_A, RADIUS_B, SENSE, OFFSET = range(10)
#: Sources of a row: first or second equation of a joint, its driver, a link that is eliminated.
FIRST, SECOND, DRIVEN, ELIMINATED = 0, 1, 2, 3


@kernel
def outline(drawn, frame, out):
    """Outline the program of a mechanism; returns what stands in the way, `SOLVABLE` if nothing.

    To ``out.structure`` go the body, the group and the marks of every link, as `divide` tells them, to ``out.counts``
    the used lengths of the other arrays, and the link that a fault names.
    """
    joints, drivers, links, counts = drawn.joints, drawn.drivers, out.structure.shape[0], out.counts
    # constraints as the pebble game takes them
    counts[:] = 0
    pairs, driver_of = np.empty((joints.shape[0], 4), np.int64), np.full(joints.shape[0], -1, np.int64)
    for k in range(drivers.shape[0]):
        driver_of[drivers[k, 0]] = k
    for k in range(joints.shape[0]):
        pairs[k, 0], pairs[k, 1] = joints[k, 1], joints[k, 2]
        pairs[k, 2], pairs[k, 3] = 1 if joints[k, 0] <= outlines.PRISMATIC else 2, driver_of[k] >= 0
    body, group, marks = np.empty(links, np.int64), np.empty(links, np.int64), np.empty(links, np.int64)
    freedoms = 3 * (links - 1)
    for k in range(joints.shape[0]):
        freedoms -= 3 - pairs[k, 2]
    why = divide(pairs, np.ones(links, np.bool_), frame, 3, body, group, marks)
    for link in range(links):
        out.structure[link, 0], out.structure[link, 1], out.structure[link, 2] = body[link], group[link], marks[link]
    if why != SOUND or freedoms != drivers.shape[0]:
        return outlines.NO_GROUPS
    # the links that drivers hang on the frame, one after another
    placed = np.zeros(links, np.bool_)
    placed[frame] = True
    k = 0
    while k < drivers.shape[0]:
        joint = drivers[k, 0]
        a, b = joints[joint, 1], joints[joint, 2]
        if group[a] == 0 and group[b] == 0 and placed[a] != placed[b]:
            drive(drawn, k, b if placed[a] else a, out)
            placed[a], placed[b] = True, True
            k = 0
        else:
            k += 1
    # then the groups
    last = 0
    for link in range(links):
        last = max(last, group[link])
    for number in range(1, last + 1):
        why = assemble_group(drawn, number, group, placed, driver_of, out)
        if why != outlines.SOLVABLE:
            return why
        for link in range(links):
            placed[link] |= group[link] == number
    return outlines.SOLVABLE


@kernel
def drive(drawn, k, link, out):
    """Add the step of driver k, which places a link."""
    joint, counts = drawn.drivers[k, 0], out.counts
    kind, a, b = drawn.joints[joint, 0], drawn.joints[joint, 1], drawn.joints[joint, 2]
    step, number = out.steps[counts[outlines.STEPS]], counts[outlines.DRIVES]
    step[:] = 0
    step[0], step[1], step[9] = codes.DRIVE_P if kind == outlines.PRISMATIC else codes.DRIVE_R, number, -1
    own = out.drives[number]
    own[0], own[1], own[2], own[3] = step[0], a if link == b else b, link, k
    counts[outlines.STEPS] += 1
    counts[outlines.DRIVES] += 1


@kernel
def assemble_group(drawn, number, group, placed, driver_of, out):
    """Add the step of a group: its links in part eliminated, its rows in the order of its closed form."""
    joints, counts, links, sizes = drawn.joints, out.counts, group.shape[0], drawn.sizes
    # own joints: all of this group among themselves and to what is placed
    own, count = np.empty(joints.shape[0], np.int64), 0
    inside = group == number
    for k in range(joints.shape[0]):
        a, b = joints[k, 1], joints[k, 2]
        if (inside[a] or inside[b]) and (inside[a] or placed[a]) and (inside[b] or placed[b]):
            own[count] = k
            count += 1
    own = own[:count]
    gone = chosen(joints, own, inside, driver_of)
    step, first_row = out.steps[counts[outlines.STEPS]], counts[outlines.ROWS]
    step[1], step[3], step[5] = first_row, counts[outlines.CORE], counts[outlines.GONE]
    step[7], step[9] = counts[outlines.TOUCHED], number - 1
    # what stays, in which place
    place = np.full(links, -1, np.int64)
    for link in range(links):
        if inside[link] and not gone[link]:
            place[link] = counts[outlines.CORE] - step[3]
            out.core[counts[outlines.CORE]] = link
            counts[outlines.CORE] += 1
    step[4] = counts[outlines.CORE] - step[3]
    # rows of the joints that are left, then of the eliminated links
    for k in own:
        kind, a, b = joints[k, 0], joints[k, 1], joints[k, 2]
        if gone[a] or gone[b]:
            continue
        codes_of = outlines.EQUATIONS[kind]
        for part in range(2 if kind <= outlines.PRISMATIC else 1):
            add_row(out, codes_of[part], a, b, place, part, k, -1, -1)
        if driver_of[k] >= 0:
            code = codes.DRIVE_ANGLE if kind == outlines.REVOLUTE else codes.DRIVE_SLIDE
            add_row(out, code, a, b, place, DRIVEN, k, -1, driver_of[k])
    for link in range(links):
        if gone[link]:
            why = eliminate(joints, sizes, own, link, place, out)
            if why != outlines.SOLVABLE:
                counts[outlines.AT] = link
                return why
    step[2], step[6] = counts[outlines.ROWS] - first_row, counts[outlines.GONE] - step[5]
    # links placed before
    for link in range(links):
        touched = False
        for k in own:
            touched |= joints[k, 1] == link or joints[k, 2] == link
        if touched and not inside[link]:
            out.touched[counts[outlines.TOUCHED]] = link
            counts[outlines.TOUCHED] += 1
    step[8] = counts[outlines.TOUCHED] - step[7]
    step[0] = closed_form(sizes, out, step)
    for r in range(first_row, counts[outlines.ROWS]):
        if out.rows[r, 0] == codes.GEAR:
            out.gears[counts[outlines.GEARS]] = r
            counts[outlines.GEARS] += 1
    counts[outlines.STEPS] += 1
    if step[0] < 0:
        counts[outlines.AT] = out.core[step[3]]
        return outlines.TURNED_TWICE
    return outlines.SOLVABLE


@kernel
def chosen(joints, own, inside, driver_of):
    """Choose the links to eliminate: two plain joints each, no two of them joined."""
    links = inside.shape[0]
    gone, near, left = np.zeros(links, np.bool_), np.empty(2, np.int64), -1
    for link in range(links):
        left += inside[link]
    for link in range(links - 1, -1, -1):
        count, plain = 0, inside[link] and left > 0
        for k in own:
            a, b = joints[k, 1], joints[k, 2]
            if a == link or b == link:
                if count < 2:
                    near[count] = b if a == link else a
                count += 1
                plain = plain and joints[k, 0] <= outlines.PRISMATIC and driver_of[k] < 0
        if plain and count == 2 and near[0] != near[1] and not (gone[near[0]] or gone[near[1]]):
            gone[link] = True
            left -= 1
    return gone


@kernel
def add_row(out, code, a, b, place, part, first, second, more):
    """Add a row between links a and b; ``part``, its joints and the link or driver tell where its numbers come from."""
    r = out.counts[outlines.ROWS]
    row, source = out.rows[r], out.source[r]
    row[0], row[1], row[2], row[3], row[4] = code, a, b, place[a], place[b]
    source[0], source[1], source[2], source[3] = part, first, second, more
    out.counts[outlines.ROWS] += 1


@kernel
def eliminate(joints, sizes, own, link, place, out):
    """Record an eliminated link and the row between its neighbours that replaces it; returns why that cannot be."""
    number, first, second = out.counts[outlines.GONE], -1, -1
    for k in own:
        if joints[k, 1] == link or joints[k, 2] == link:
            first, second = (k, second) if first < 0 else (first, k)
    if joints[first, 0] == outlines.PRISMATIC and joints[second, 0] == outlines.REVOLUTE:
        first, second = second, first
    a = joints[first, 1] + joints[first, 2] - link
    b = joints[second, 1] + joints[second, 2] - link
    kind = codes.E_PP if joints[first, 0] == outlines.PRISMATIC else codes.E_RP
    kind = codes.E_RR if joints[second, 0] == outlines.REVOLUTE else kind
    gone = out.eliminated[number]
    gone[0], gone[1], gone[2], gone[3] = kind, link, a, b
    out.pins[number, 0], out.pins[number, 1] = first, second
    out.counts[outlines.GONE] += 1
    if kind == codes.E_RP:  # the pin of a runs on a line of b
        add_row(out, codes.LINE, b, a, place, ELIMINATED, first, second, link)
        return outlines.SOLVABLE
    for s in range(sizes.shape[0]):
        _, _, px, py, _, da = seen(joints, sizes[s], first, link)
        _, _, qx, qy, _, db = seen(joints, sizes[s], second, link)
        if kind == codes.E_RR and px == qx and py == qy:
            return outlines.NO_LENGTH
        if kind == codes.E_PP and abs(sin(da - db)) <= codes.PARALLEL:
            return outlines.PARALLEL_GUIDES
    add_row(out, codes.DIST if kind == codes.E_RR else codes.ANGLE, a, b, place, ELIMINATED, first, second, link)
    return outlines.SOLVABLE


@kernel
def seen(joints, size, k, link):
    """Of joint k: the point of the other link, the point of this one, and the directions there."""
    p = size[k]
    if link == joints[k, 2]:
        return p[AX], p[AY], p[BX], p[BY], p[A_ANGLE], p[B_ANGLE]
    return p[BX], p[BY], p[AX], p[AY], p[B_ANGLE], p[A_ANGLE]


@kernel
def closed_form(sizes, out, step):
    """Put the rows of a group in the order of its closed form, if it has one; returns the code of the step, or -1."""
    r0, nr = step[1], step[2]
    if step[4] != 1:
        return codes.NEWTON
    have = np.zeros(codes.CAM + 1, np.int64)
    for r in range(r0, r0 + nr):
        have[out.rows[r, 0]] += 1
    dist, line, angle = have[codes.DIST], have[codes.LINE], have[codes.ANGLE]
    if dist == 3:
        return codes.PLATFORM
    own = out.core[step[3]]
    if have[codes.RX] and (dist or line or angle or (have[codes.GEAR] and centred(sizes, out, r0, own))):
        put(out, r0, 0, codes.RX)
        put(out, r0, 1, codes.RY)
        if line:
            return codes.R_LINE_PIN if out.rows[r0 + 2, 2] == own else codes.R_LINE_SLOT
        return codes.R_DIST if dist else codes.R_ANGLE if angle else codes.R_GEAR
    if angle == 1 and line + dist == 2 and line > 0:
        put(out, r0, 0, codes.LINE)
        put(out, r0, 1, codes.ANGLE)
        return codes.P_LINE if line == 2 else codes.P_DIST
    return -1 if angle > 1 else codes.NEWTON


@kernel
def put(out, r0, to, kind):
    """Move the first row of a kind to a place of its group; the rows between move on."""
    k = r0 + to
    while out.rows[k, 0] != kind:
        k += 1
    for r in range(k, r0 + to, -1):
        for c in range(5):
            out.rows[r, c], out.rows[r - 1, c] = out.rows[r - 1, c], out.rows[r, c]
        for c in range(4):
            out.source[r, c], out.source[r - 1, c] = out.source[r - 1, c], out.source[r, c]


@kernel
def centred(sizes, out, r0, own):
    """Whether the wheel of a link lies on the revolute joint that holds it, in every set."""
    held = r0
    while out.rows[held, 0] != codes.RX:
        held += 1
    wheel = r0
    while out.rows[wheel, 0] != codes.GEAR:
        wheel += 1
    i = BX if out.rows[held, 2] == own else AX
    j = BX if out.rows[wheel, 2] == own else AX
    for s in range(sizes.shape[0]):
        p, q = sizes[s, out.source[held, 1]], sizes[s, out.source[wheel, 1]]
        if p[i] != q[j] or p[i + 1] != q[j + 1]:
            return False
    return True


# --- the numbers


@kernel
def fill(drawn, out, row_table, eliminated_table, drive_table):
    """Write the numbers of an outline, whose arrays have the used lengths, for every dimension set."""
    joints, counts = drawn.joints, out.counts
    for s in range(row_table.shape[0]):
        size = drawn.sizes[s]
        slot = 0
        for r in range(counts[outlines.ROWS]):
            p, source = row_table[s, r], out.source[r]
            p[:] = 0.0
            if source[0] == ELIMINATED:
                replaced_row(joints, size, out.rows[r, 0], source[1], source[2], source[3], p)
            else:
                joint_row(drawn, size, out.rows[r, 0], source[1], source[3], p)
            if out.rows[r, 0] == codes.GEAR:
                p[codes.SLOT] = slot
                slot += 1
        for k in range(counts[outlines.GONE]):
            p, kind, link = eliminated_table[s, k], out.eliminated[k, 0], out.eliminated[k, 1]
            p[0], p[1], p[2], p[3], da, dea = seen(joints, size, out.pins[k, 0], link)
            p[4], p[5], p[6], p[7], db, deb = seen(joints, size, out.pins[k, 1], link)
            p[8], p[9], p[10], p[11] = cos(da), sin(da), cos(db), sin(db)
            p[12] = 0.0 if kind == codes.E_RR else db - deb if kind == codes.E_RP else da - dea
        for k in range(counts[outlines.DRIVES]):
            p, link = drive_table[s, k], out.drives[k, 2]
            joint, base = drawn.drivers[out.drives[k, 3], 0], drawn.drivers[out.drives[k, 3], 1]
            p[0], p[1], p[4], p[5], da, db = seen(joints, size, joint, link)
            p[2], p[3] = cos(da), sin(da)
            p[6] = 1.0 if (base == joints[joint, 1]) == (link == joints[joint, 2]) else -1.0
            p[7] = da - db


@kernel
def joint_row(drawn, size, code, k, driver, p):
    """Write the numbers of a row of joint k, or of its driver."""
    own = size[k]
    p[codes.PAX], p[codes.PAY], p[codes.PBX], p[codes.PBY], p[codes.TX] = own[AX], own[AY], own[BX], own[BY], 1.0
    if code in (codes.LINE, codes.ANGLE, codes.DRIVE_ANGLE, codes.DRIVE_SLIDE):
        p[codes.TX], p[codes.TY] = cos(own[A_ANGLE]), sin(own[A_ANGLE])
    if code == codes.ANGLE:
        p[codes.H] = own[A_ANGLE] - own[B_ANGLE]
    elif code == codes.GEAR:
        p[codes.RA], p[codes.RB], p[codes.SIGN], p[codes.H] = own[RADIUS_A], own[RADIUS_B], own[SENSE], own[OFFSET]
    elif code == codes.CAM:
        p[codes.RA], p[codes.H] = own[A_ANGLE], own[RADIUS_A]
        for c in range(drawn.waves.shape[1]):
            p[codes.CAM_WIDTH + c] = drawn.waves[k, c]
    elif code in (codes.DRIVE_ANGLE, codes.DRIVE_SLIDE):
        p[codes.SIGN] = 1.0 if drawn.drivers[driver, 1] == drawn.joints[k, 1] else -1.0
        p[codes.SLOT] = driver


@kernel
def replaced_row(joints, size, code, first, second, link, p):
    """Write the numbers of the row between the neighbours of an eliminated link."""
    pax, pay, eax, eay, da, dea = seen(joints, size, first, link)
    pbx, pby, ebx, eby, db, deb = seen(joints, size, second, link)
    p[codes.PAX], p[codes.PAY], p[codes.PBX], p[codes.PBY], p[codes.TX] = pax, pay, pbx, pby, 1.0
    if code == codes.DIST:
        length = hypot(ebx - eax, eby - eay)
        p[codes.H], p[codes.INVERSE] = length, 1.0 / length
    elif code == codes.ANGLE:
        p[codes.H] = da - dea + deb - db
    else:
        p[codes.PAX], p[codes.PAY], p[codes.PBX], p[codes.PBY] = pbx, pby, pax, pay
        p[codes.TX], p[codes.TY] = cos(db), sin(db)
        p[codes.H] = cos(deb) * (eay - eby) - sin(deb) * (eax - ebx)


@kernel
def joint_rows(drawn, rows, row_table):
    """Write all equations of the joints, then those of the drivers, as rows in which no link is eliminated.

    ``rows`` int64 (rows, 6): code, links a and b, twice -1, the joint; ``row_table`` (sets, rows, width).  A joint of
    mobility 1 has two rows, any other one.
    """
    joints, count, gears = drawn.joints, 0, 0
    for k in range(joints.shape[0] + drawn.drivers.shape[0]):
        driver = k - joints.shape[0]
        joint = k if driver < 0 else drawn.drivers[driver, 0]
        kind = joints[joint, 0]
        for part in range(2 if kind <= outlines.PRISMATIC and driver < 0 else 1):
            code = outlines.EQUATIONS[kind][part]
            if driver >= 0:
                code = codes.DRIVE_ANGLE if kind == outlines.REVOLUTE else codes.DRIVE_SLIDE
            row = rows[count]
            row[0], row[1], row[2], row[3], row[4], row[5] = code, joints[joint, 1], joints[joint, 2], -1, -1, joint
            for s in range(row_table.shape[0]):
                row_table[s, count, :] = 0.0
                joint_row(drawn, drawn.sizes[s], code, joint, driver, row_table[s, count])
                if code == codes.GEAR:
                    row_table[s, count, codes.SLOT] = gears
            gears += code == codes.GEAR
            count += 1


@kernel
def sizes_of(drawn, links):
    """Characteristic length of a mechanism, and the distance from which on a link has gone away.

    The first is the largest distance between two joint points of one link from its first one, 1 if there is none.
    """
    joints, numbers = drawn.joints, drawn.sizes[0]
    spread, largest = 0.0, 0.0
    for link in range(links):
        count, x, y = 0, 0.0, 0.0
        for k in range(joints.shape[0]):
            if joints[k, 1] != link and joints[k, 2] != link:
                continue
            c = AX if joints[k, 1] == link else BX
            if count == 0:
                x, y = numbers[k, c], numbers[k, c + 1]
            count += 1
            spread = max(spread, hypot(numbers[k, c] - x, numbers[k, c + 1] - y))
    for k in range(joints.shape[0]):
        for c in (AX, AX + 1, BX, BX + 1, RADIUS_A, RADIUS_B):
            largest = max(largest, abs(numbers[k, c]))
    spread = spread if spread > 0.0 else 1.0
    return spread, links * spread + 4.0 * largest
