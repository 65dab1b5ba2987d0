// SPDX-License-Identifier: MIT
// Samples of the scope as an MCAP file, with the topics, schemas and metadata of `hal record`: a
// topic per thread, messages in CDR with a field per value, events as JSON.
import {McapWriter} from './mcap_writer.js';

const eventSchema = JSON.stringify({
    type: 'object',
    properties: {kind: {type: 'string'}, text: {type: 'string'}},
    required: ['kind', 'text']
});

/// How the values of a type are written: the word of ROS 2, its bytes, and how they are put.
const kinds = {
    float: {word: 'float64', bytes: 8, put: (to, value) => to.float64(value)},
    s64: {word: 'int64', bytes: 8, put: (to, value) => to.uint64(BigInt.asUintN(64, whole(value)))},
    u64: {word: 'uint64', bytes: 8, put: (to, value) => to.uint64(whole(value))},
    s32: {word: 'int32', bytes: 4, put: (to, value) => to.uint32(value >>> 0)},
    u32: {word: 'uint32', bytes: 4, put: (to, value) => to.uint32(value)},
    bit: {word: 'bool', bytes: 1, put: (to, value) => to.uint8(value ? 1 : 0)}
};
const whole = value => BigInt(Number.isFinite(value) ? Math.trunc(value) : 0);

/// A name as ROS wants it for fields: lower case, a letter first, no two underscores in a row.
export function rosName(name) {
    const field =
        name.toLowerCase().replace(/[^a-z0-9]+/g, '_').replace(/^_+|_+$/g, '') || 'v';
    return /^[0-9]/.test(field) ? `v_${field}` : field;
}

/// servo-thread: ServoThread, as ROS names messages.
export function messageName(thread) {
    let name = '', begins = true;
    for (const c of thread) {
        const isLetter = /[A-Za-z]/.test(c), isPart = isLetter || (/[0-9]/.test(c) && name !== '');
        if (isPart) name += begins ? c.toUpperCase() : c;
        begins = !isLetter;
    }
    return name || 'Values';
}

/// A name that is not in `taken` yet: `name`, or with 2, 3, … behind it.
function unique(name, taken, between) {
    let found = name;
    for (let n = 2; taken.has(found); n++)
        found = `${name}${between}${n}`;
    taken.add(found);
    return found;
}

const cdrHeader = [0, 1, 0, 0];  // little-endian

/** The rows of a group of the scope as messages. */
class Rows {
    constructor(group, columns) {
        this.group = group;
        const taken = new Set();
        this.fields = columns.map(one => ({
            ...one,
            kind: kinds[one.type] ?? kinds.float,
            field: unique(rosName(one.name), taken, '_')
        }));
        this.order = [...this.fields].sort((a, b) => b.kind.bytes - a.kind.bytes);
    }
    schema() { return this.order.map(({kind, field}) => `${kind.word} ${field}\n`).join(''); }
    metadata() {
        const entries = {
            thread: this.group.thread,
            period_ns: String(this.group.period_ns)
        };
        for (const {field, name, unit} of this.fields) {
            entries[`pin.${field}`] = name;
            if (unit) entries[`unit.${field}`] = unit;
        }
        return entries;
    }
    /// Appends the message of a row.
    put(to, row) {
        to.bytes(cdrHeader);
        for (const {kind, column} of this.order)
            kind.put(to, this.group.value(column, row));
    }
}

/// The groups that have some of these channels, with the columns to write.
function groupsOf(store, names) {
    const groups = new Map();
    for (const name of names) {
        if (!store.place.has(name)) continue;
        const [group, column] = store.place.get(name);
        if (!groups.has(group)) groups.set(group, []);
        groups.get(group).push({...store.columnsOf.get(name), name, column});
    }
    return groups;
}

/**
 * The samples between two times as an MCAP file that `hal replay`, `hal plot` and other readers
 * open. Integers beyond 2^53 are rounded, as the scope keeps them.
 * @param {import('./scope_data.js').Store} store
 * @param {string[]} names channels
 * @param {number} from s
 * @param {number} to s
 * @param {{time_ns: number, kind: string, text: string}[]} events on the machine's clock
 * @param {{instance: string, version: string}} about
 * @returns {Uint8Array}
 */
export function mcap(store, names, from, to, events, {instance, version}) {
    const writer = new McapWriter(), start = BigInt(Math.round(store.origin ?? 0)),
          offset = BigInt(Math.round(store.unixOffset));
    writer.metadata('halcyon', {instance, version, unix_offset_ns: String(offset)});
    const messages = [], topics = new Set(), types = new Set();
    for (const [group, columns] of groupsOf(store, names)) {
        const rows = new Rows(group, columns), thread = group.thread || 'no-thread';
        const type = unique(`halcyon_msgs/msg/${messageName(thread)}`, types, 'V');
        const schema = writer.addSchema(type, 'ros2msg', rows.schema());
        const topic = unique(`/hal/${thread}`, topics, '_');
        const channel = writer.addChannel(schema, topic, 'cdr', rows.metadata());
        for (let row = group.row(from); row < group.count && group.time(row) <= to; row++)
            messages.push({
                time: BigInt(Math.round(group.time(row) * 1e9)) + start,
                channel,
                sequence: group.cycle(row),
                fill: record => rows.put(record, row)
            });
    }
    const schema = writer.addSchema('halcyon.Event', 'jsonschema', eventSchema);
    const channel = writer.addChannel(schema, '/hal/events', 'json', {});
    events.forEach(({time_ns, kind, text}, sequence) => {
        const bytes = new TextEncoder().encode(JSON.stringify({kind, text}));
        const time = BigInt(Math.round(time_ns));
        messages.push({time, channel, sequence, fill: record => record.bytes(bytes)});
    });
    messages.sort((a, b) => Number(a.time - b.time));
    for (const {channel, sequence, time, fill} of messages)
        writer.message(channel, sequence, time + offset, fill);
    return writer.close();
}
