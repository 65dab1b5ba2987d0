// SPDX-License-Identifier: MIT
// Samples of the scope: a ring per group of channels, the trigger, measurements. No drawing.

const capacity = 1 << 18;

/// Rows that were sampled together: times in seconds, and the values of some channels.
class Group {
    /// `hold`: seconds for which a value holds while no newer one comes. `thread`: empty for values
    /// without one.
    constructor({columns, thread, period_ns}, hold) {
        this.columns = columns;
        this.thread = thread ?? '';
        this.period_ns = period_ns ?? 0;
        this.hold = hold;
        this.times = new Float64Array(capacity);
        this.cycles = new Float64Array(capacity);
        this.values = columns.map(() => new Float64Array(capacity));
        this.count = 0;  // rows ever added; row i is at i % capacity
    }
    get first() { return Math.max(0, this.count - capacity + 1); }
    time(row) { return this.times[row & (capacity - 1)]; }
    value(column, row) { return this.values[column][row & (capacity - 1)]; }
    cycle(row) { return this.cycles[row & (capacity - 1)]; }
    /// Whether rows of a time that was shown are overwritten.
    isOverwritten(time) { return this.first > 0 && time < this.time(this.first); }
    /// Begins a row; returns its place in the columns.
    add(time, cycle = 0) {
        const at = this.count++ & (capacity - 1);
        this.times[at] = time;
        this.cycles[at] = cycle;
        return at;
    }
    /// The first row at or after a time.
    row(time) {
        let low = this.first, high = this.count;
        while (low < high) {
            const middle = Math.floor((low + high) / 2);
            if (this.time(middle) < time)
                low = middle + 1;
            else
                high = middle;
        }
        return low;
    }
}

/// Minimum and maximum of a channel in each interval of `width` seconds, kept up to date as rows
/// arrive: what a column of pixels shows.
class Columns {
    static made = 0;
    constructor(group, column, width, size = 1 << 13) {
        this.number = ++Columns.made;  // another one after each restart
        this.group = group;
        this.column = column;
        this.width = width;
        this.row = group.first;
        this.newest = -1;
        this.last = NaN;
        this.mask = size - 1;  // interval i is at i & mask, if index has i there
        this.index = new Float64Array(size).fill(NaN);
        this.low = new Float64Array(size);
        this.high = new Float64Array(size);
    }
    update() {
        const {group, index, low, high, width} = this, {times} = group,
                                        values = group.values[this.column], mask = capacity - 1;
        for (let row = Math.max(this.row, group.first); row < group.count; row++) {
            const value = values[row & mask], interval = Math.floor(times[row & mask] / width),
                  at = interval & this.mask;
            if (Number.isNaN(value)) continue;
            if (index[at] !== interval) {  // from the last value on, so that the trace has no holes
                index[at] = interval;
                low[at] = this.last < value ? this.last : value;
                high[at] = this.last > value ? this.last : value;
            } else if (value < low[at])
                low[at] = value;
            else if (value > high[at])
                high[at] = value;
            this.newest = interval;
            this.last = value;
        }
        this.row = group.count;
    }
    /// The lowest and the highest value between two times as [low, high]; null without one.
    extremes(from, to) {
        const first = Math.floor(from / this.width),
              last = Math.max(first, Math.ceil(to / this.width) - 1);
        let low = Infinity, high = -Infinity;
        for (let interval = first; interval <= last; interval++) {
            const at = interval & this.mask;
            if (this.index[at] !== interval) continue;
            low = Math.min(low, this.low[at]);
            high = Math.max(high, this.high[at]);
        }
        return low <= high ? [low, high] : null;
    }
}

/// Minimum and maximum of every 10 ms of the last 10 minutes: what remains of overwritten rows.
const pastWidth = .01, pastSize = 1 << 16;
const keepEvery = (1 << 14) - 1;  // mask of rows: how often it is looked whether some will be lost

/// Values of a thread come in every cycle, and those without a thread when they change.
function holdOf({thread, period_ns}) { return thread ? Math.max(.1, 5e-9 * period_ns) : Infinity; }

export class Store {
    constructor() { this.clear(); }
    clear() {
        this.groups = [];
        this.place = new Map();  // channel -> [group, column]
        this.newest = 0;
        this.lost = 0;
        this.rows = 0;
        this.gaps = 0;
        this.origin = null;
        this.unixOffset = 0;  // ns: from the machine's clock to Unix time; 0: unknown
        this.cut = new Map();   // channel -> Columns
        this.past = new Map();  // channel -> Columns of the last 10 minutes
        this.pastWidth = pastWidth;  // s
        this.columnsOf = new Map();  // channel -> {name, type, unit}
    }
    /// The Columns of a channel, up to date.
    columns(name, width) {
        let columns = this.cut.get(name);
        if (!columns || columns.width !== width)
            this.cut.set(name, columns = new Columns(...this.place.get(name), width));
        columns.update();
        return columns;
    }
    /// The minima and maxima of the last 10 minutes of a channel, up to date.
    history(name) {
        if (!this.past.has(name))
            this.past.set(name, new Columns(...this.place.get(name), this.pastWidth, pastSize));
        const columns = this.past.get(name);
        columns.update();
        return columns;
    }
    /// Whether a channel has only minima and maxima of a time.
    isCoarse(name, from) { return this.place.get(name)?.[0].isOverwritten(from) ?? false; }
    /// Begins another layout. `columns`: {name, type, unit} of each name, as a probe has them.
    /// `length`: seconds of all rows, when that is known.
    layout(groups, names, columns = [], length = 0) {
        this.clear();
        this.pastWidth = Math.max(pastWidth, length / (pastSize - 2));
        this.groups = groups.map(group => new Group(group, holdOf(group)));
        this.cycles = groups.map(() => -1);
        groups.forEach(
            (group, g) => group.columns.forEach(
                (channel, column) => this.place.set(names[channel], [this.groups[g], column])));
        for (const column of columns)
            this.columnsOf.set(column.name, column);
        for (const name of this.place.keys())
            this.history(name);
    }
    /// The time of the first row, or of the first minimum, that is kept.
    get oldest() {
        const times = this.groups.filter(group => group.count > 0).map(group => {
            const first = group.time(group.first);
            return group.first > 0 ? Math.max(0, this.newest - this.pastWidth * pastSize) : first;
        });
        return Math.min(this.newest, ...times);
    }
    /// Brings minima and maxima up to date before their rows are overwritten.
    keepPast() {
        for (const [name, columns] of this.past)
            if (columns.group.count - columns.row > capacity / 4) this.history(name);
    }
    seconds(ns) {
        this.origin ??= ns;
        return (ns - this.origin) / 1e9;
    }
    /// Takes a batch of a probe: rows of 8-byte words, cycle, time, values; little-endian, as all
    /// browsers are.
    samples(event, bytes, layout) {
        const reals = new Float64Array(bytes), lows = new Uint32Array(bytes),
              highs = new Int32Array(bytes), every = layout.every ?? 1;
        let word = 0;
        for (const part of event.parts) {
            const group = this.groups[part.group],
                  types = group.columns.map(channel => layout.columns[channel].type);
            this.lost += part.lost;
            for (let row = 0; row < part.rows; row++) {
                const cycle = lows[2 * word] + lows[2 * word + 1] * 4294967296;
                if (cycle > 0 && this.cycles[part.group] >= 0 &&
                    cycle !== this.cycles[part.group] + every)
                    this.gaps++;
                this.cycles[part.group] = cycle;
                if ((group.count & keepEvery) === 0) this.keepPast();
                const ns = lows[2 * word + 2] + highs[2 * word + 3] * 4294967296,
                      at = group.add(this.seconds(ns), cycle);
                word += 2;
                for (let column = 0; column < types.length; column++, word++) {
                    const type = types[column];
                    group.values[column][at] = type === 'float' ? reals[word] :
                                                                  lows[2 * word] +
                            (type === 's32' || type === 's64' ? highs[2 * word + 1] :
                                                                lows[2 * word + 1]) *
                                4294967296;
                }
            }
            this.rows += part.rows;
        }
        this.newest = Math.max(this.newest, this.seconds(event.until_ns));
        this.keepPast();
    }
    /// Takes the values of a subscription.
    values(event) {
        const time = this.seconds(event.time_ns), [group] = this.groups, at = group.add(time);
        group.columns.forEach((channel, column) => {
            group.values[column][at] = Number(event.values[channel] ?? NaN);
        });
        this.rows++;
        this.lost += event.skipped ?? 0;
        this.newest = time;
    }
}

/// Finds edges as samples arrive. A rising edge is armed below level - hysteresis and fires at the
/// first value not below the level.
export class Trigger {
    constructor(name, edge, level) {
        this.name = name;
        this.edge = edge;  // rising, falling or either
        this.level = level;
        this.armed = 0;  // bit 0: for a rising edge, bit 1: for a falling one
        this.row = 0;    // the first row that was not scanned
        this.range = undefined;
    }
    /// Returns the times of the edges since the last call, interpolated between two samples.
    scan(store) {
        const found = [], place = store.place.get(this.name);
        if (!place) return found;
        const [group, column] = place;
        let row = Math.max(this.row, group.first);
        for (; row < group.count; row++) {
            const value = group.value(column, row);
            if (this.range === undefined) this.range = [value, value];
            this.range[0] = Math.min(this.range[0], value);
            this.range[1] = Math.max(this.range[1], value);
            const gap = (this.range[1] - this.range[0]) * .01;
            for (const rising of this.edge === 'either' ? [true, false] :
                                                          [this.edge === 'rising']) {
                const bit = rising ? 1 : 2, sign = rising ? 1 : -1;
                if (sign * (value - this.level) < -gap ||
                    (gap === 0 && sign * (value - this.level) < 0))
                    this.armed |= bit;
                else if (sign * (value - this.level) >= 0 && this.armed & bit) {
                    this.armed &= ~bit;
                    const before = row > group.first ? group.value(column, row - 1) : value,
                          t = group.time(row), t0 = row > group.first ? group.time(row - 1) : t;
                    found.push(
                        value === before ? t :
                                           t0 +
                                (t - t0) *
                                    Math.min(
                                        1, Math.max(0, (this.level - before) / (value - before))));
                }
            }
        }
        this.row = row;
        return found;
    }
}

/// Minimum and maximum of a time whose rows are overwritten; the other figures are unknown.
function measureCoarse(store, name, from, to) {
    const found = store.history(name).extremes(from, to);
    if (!found) return null;
    const [min, max] = found;
    return {min, max, mean: null, rms: null, deviation: null, frequency: null, count: 0};
}

/// The times at which values from `min` to `max` rise through their middle, interpolated between
/// two samples.
function risingEdges(group, values, begin, end, min, max) {
    const middle = (min + max) / 2, armedBelow = middle - (max - min) * .1, mask = capacity - 1;
    const edges = [];
    let armed = false;
    for (let row = begin + 1; row < end && max > min; row++) {
        const value = values[row & mask];
        if (value < armedBelow)
            armed = true;
        else if (armed && value >= middle) {
            armed = false;
            const before = values[(row - 1) & mask], first = group.time(row - 1);
            const share = value === before ? 0 : (middle - before) / (value - before);
            edges.push(first + (group.time(row) - first) * Math.min(1, Math.max(0, share)));
        }
    }
    return edges;
}

/// Minimum, maximum, mean, rms, standard deviation and frequency between two times; null without
/// samples. The frequency needs two rising crossings of the middle. Of a time whose rows are
/// overwritten only minimum and maximum are known, the others are null.
export function measure(store, name, from, to) {
    const place = store.place.get(name);
    if (!place) return null;
    if (store.isCoarse(name, from)) return measureCoarse(store, name, from, to);
    const [group, column] = place, begin = group.row(from), end = group.row(to);
    const values = group.values[column], mask = capacity - 1;  // the hot loops: no calls
    let min = Infinity, max = -Infinity, mean = 0, squares = 0, deviations = 0, count = 0;
    for (let row = begin; row < end; row++) {
        const value = values[row & mask], off = value - mean;
        if (!Number.isFinite(value)) continue;
        if (value < min) min = value;
        if (value > max) max = value;
        squares += value * value;
        mean += off / ++count;  // Welford: exact beside a large mean
        deviations += off * (value - mean);
    }
    if (count === 0) return null;
    const edges = risingEdges(group, values, begin, end, min, max);
    const frequency =
        edges.length > 1 ? (edges.length - 1) / (edges[edges.length - 1] - edges[0]) : null;
    const rms = Math.sqrt(squares / count), deviation = Math.sqrt(deviations / count);
    return {min, max, mean, rms, deviation, frequency, count};
}

/// The value of a channel at a time: that of the last row not after it.
export function valueAt(store, name, time) {
    const place = store.place.get(name);
    if (!place) return null;
    const row = place[0].row(time + 1e-12) - 1;
    return row < place[0].first ? null : place[0].value(place[1], row);
}
