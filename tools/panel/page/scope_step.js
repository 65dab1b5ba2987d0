// SPDX-License-Identifier: MIT
// Measures of a step response. No drawing.
import {valueAt} from './scope_data.js';

/// The time at which a channel reaches `level` for the first time in rows [begin, end), in the
/// direction `sign`; interpolated between two rows. Null: never.
function reached({group, column}, begin, end, level, sign) {
    for (let row = begin; row < end; row++) {
        const value = group.value(column, row);
        if (!(sign * (value - level) >= 0)) continue;
        const before = row > begin ? group.value(column, row - 1) : value,
              last = row > begin ? group.time(row - 1) : group.time(row);
        if (value === before) return group.time(row);
        return last + (group.time(row) - last) * (level - before) / (value - before);
    }
    return null;
}

/// The time from which on all rows before `end` are within `band` of `final`; interpolated. Null:
/// the last row is outside.
function settledAt({group, column}, begin, end, final, band) {
    for (let row = end - 1; row >= begin; row--) {
        const off = group.value(column, row) - final;
        if (Math.abs(off) <= band) continue;
        if (row === end - 1) return null;
        const next = group.value(column, row + 1) - final, edge = Math.sign(off) * band,
              from = group.time(row);
        return from + (group.time(row + 1) - from) * (off - edge) / (off - next);
    }
    return group.time(begin);
}

/// The mean of the finite values of rows [begin, end), their extremes, and whether there are any.
function statistics({group, column}, begin, end) {
    let sum = 0, count = 0, min = Infinity, max = -Infinity;
    for (let row = begin; row < end; row++) {
        const value = group.value(column, row);
        if (!Number.isFinite(value)) continue;
        sum += value;
        count++;
        min = Math.min(min, value);
        max = Math.max(max, value);
    }
    return {mean: sum / count, count, min, max};
}

/**
 * Measures a step response that begins at `from` and is in its steady state at `to`, in the terms
 * of IEC 60050-351 with the usual limits:
 *
 *   initial    the value at `from`
 *   final      the steady state: the mean of the last tenth of the time
 *   rise       from the first passage of 10 % of the step to that of 90 %, s
 *   overshoot  largest excess over the final value, in percent of the step; 0 without one
 *   settling   from `from` until the value stays within 2 % of the step around the final one, s;
 * null when it does not stay there during the last tenth of the time
 *
 * @returns {{initial: number, final: number, rise: number | null, overshoot: number,
 *     settling: number | null} | null} null without a step: no sample at `from`, or a step that is
 *     smaller than the variation in the steady state
 */
export function stepResponse(store, name, from, to) {
    const place = store.place.get(name);
    if (!place) return null;
    const [group, column] = place, channel = {group, column};
    const begin = group.row(from), end = group.row(to), steady = group.row(to - (to - from) / 10);
    const last = statistics(channel, steady, end), whole = statistics(channel, begin, end);
    const initial = valueAt(store, name, from);
    if (last.count === 0 || !Number.isFinite(initial)) return null;
    const final = last.mean, step = final - initial, sign = Math.sign(step), size = Math.abs(step);
    if (size === 0 || last.max - last.min > size) return null;
    const low = reached(channel, begin, end, initial + .1 * step, sign),
          high = reached(channel, begin, end, initial + .9 * step, sign);
    const peak = sign > 0 ? whole.max : whole.min,
          settled = settledAt(channel, begin, end, final, .02 * size);
    const isSettled = settled !== null && settled <= group.time(steady);
    return {
        initial,
        final,
        rise: low === null || high === null ? null : high - low,
        overshoot: Math.max(0, 100 * sign * (peak - final) / size),
        settling: isSettled ? settled - from : null
    };
}
