// SPDX-License-Identifier: MIT
// Everything that has a value: pins, parameters, signals. Read once, and again when the machine was
// edited.
import {on, request} from './link.js';

let cache = null;
on('machine', () => {
    cache = null;
});

/// Returns a Map of name -> {kind, type, dir, value, signal, writer, pins, unit, doc, instance,
/// thread}.
export async function objects(fresh = false) {
    if (cache && !fresh) return cache;
    const all = new Map();
    for (const kind of ['pin', 'param', 'sig']) {
        const reply = await request({describe: kind});
        if (!reply.ok) return cache ?? all;
        for (const object of reply.objects)
            all.set(object.name, {kind, ...object});
    }
    for (const object of all.values())
        if (object.alias) all.set(object.alias, object);
    cache = all;
    return all;
}

/// Returns true when setp or sets accepts it.
export function settable(object) {
    if (object.kind === 'sig') return !object.writer;
    if (object.kind === 'param') return object.dir === 'RW';
    return (object.dir === 'IN' || object.dir === 'I/O') && !object.signal;
}
