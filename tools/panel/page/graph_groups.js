// SPDX-License-Identifier: MIT
// Which instances belong together in the drawing of a netlist.

/** How instances can be grouped, with the text to choose it. */
export const groupings = [
    ['none', 'no groups'], ['name', 'group by name'], ['component', 'group by component'],
    ['file', 'group by file'], ['thread', 'group by thread']
];

/**
 * @typedef {object} Instance
 * @property {string} name
 * @property {string} component
 * @property {string} file whose line made it
 * @property {string} thread that runs it; '' none
 */

/**
 * The instances that own pins. Pins of functions and threads, as axis.0.pid.time, have none.
 * @param {Iterable<any>} objects pins, parameters, signals
 * @returns {Map<string, Instance>}
 */
export function instancesOf(objects) {
    const found = new Map();
    for (const one of objects) {
        if (one.kind !== 'pin' || !one.instance) continue;
        const name = one.instance;
        if (!found.has(name)) {
            const component = one.component ?? name;
            const file = one.file ?? '';
            found.set(name, {name, component, file, thread: ''});
        }
        found.get(name).thread ||= one.thread ?? '';
    }
    return found;
}

/// The instance that owns a pin, or the component of a pin without one.
export const instanceOf = pin => pin.instance ?? pin.component ?? pin.name.split('.')[0];

/// The beginnings of a name that end before a dot, a dash or an underscore, the longest first:
/// axis.0.pid has axis.0 and axis.
function beginnings(name) {
    const found = [];
    for (let i = name.length - 1; i > 0; i--)
        if (name[i] === '.' || name[i] === '-' || name[i] === '_') found.push(name.slice(0, i));
    return found;
}

/// The last part of a name, if it is a word: x of pid.x.
function lastWord(name) {
    const part = name.split(/[.\-_]/).pop();
    return part !== name && /[a-z]/i.test(part) ? part : '';
}

/// Which components the instances of each key have.
function componentsOf(instances, keysOf) {
    const found = new Map();
    for (const {name, component} of instances)
        for (const key of keysOf(name)) {
            if (!found.has(key)) found.set(key, new Set());
            found.get(key).add(component);
        }
    return found;
}

/// Groups by what names have in common: axis.0.pid and axis.0.limit by axis.0, pid.x and limit.x by
/// x, numbered instances of one component, as and2.0 and and2.1, by that.
function byName(instances) {
    const begins = componentsOf(instances, beginnings),
          ends = componentsOf(instances, name => [lastWord(name)].filter(word => word));
    return ({name, component}) => {
        const begin = beginnings(name).find(key => begins.get(key).size > 1);
        if (begin) return begin;
        const end = lastWord(name);
        if (end && ends.get(end).size > 1) return end;
        return name.startsWith(`${component}.`) ? component : name;
    };
}

/// The shortest end of a path, in whole parts, that no other of the paths has: motors.hal, or
/// x/motors.hal when there is a y/motors.hal.
function shortestEnd(path, paths) {
    const parts = path.split('/'), others = paths.filter(other => other !== path);
    for (let count = 1; count < parts.length; count++) {
        const end = parts.slice(-count).join('/');
        if (!others.some(other => other === end || other.endsWith(`/${end}`))) return end;
    }
    return path;
}

/// Groups by the file whose line made the instance.
function byFile(instances) {
    const paths = [...new Set(instances.map(({file}) => file))];
    const titles = new Map(paths.map(path => [path, shortestEnd(path, paths)]));
    return ({file}) => titles.get(file) || 'no file';
}

const keys = {
    name: byName,
    component: () => ({component}) => component,
    file: byFile,
    thread: () => ({thread}) => thread || 'no thread'
};

/**
 * The group of each instance. An instance alone in its group has none.
 * @param {Map<string, Instance>} instances
 * @param {string} grouping of `groupings`
 * @returns {Map<string, string>} instance -> group
 */
export function groupsOf(instances, grouping) {
    if (!(grouping in keys)) return new Map();
    const all = [...instances.values()], keyOf = keys[grouping](all), sizes = new Map();
    const found = new Map(all.map(one => [one.name, keyOf(one)]));
    for (const key of found.values())
        sizes.set(key, (sizes.get(key) ?? 0) + 1);
    for (const [name, key] of found)
        if (sizes.get(key) === 1) found.delete(name);
    return found;
}
