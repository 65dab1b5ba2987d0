// SPDX-License-Identifier: MIT
// Rules about the modules of the page.
import assert from 'node:assert/strict';
import {readdirSync, readFileSync} from 'node:fs';
import {test} from 'node:test';

const folder = new URL('../../tools/panel/page/', import.meta.url);
const modules = new Map(
    readdirSync(folder)
        .filter(name => name.endsWith('.js'))
        .map(name => [name, readFileSync(new URL(name, folder), 'utf8')]));

/// The modules that one imports, also later.
const imports = name =>
    [...modules.get(name).matchAll(/(?:from|import\() ?'\.\/([\w.]+)'/g)].map(([, file]) => file);

/// All modules that are reached from one.
function reached(name) {
    const found = new Set(), waiting = imports(name);
    while (waiting.length > 0) {
        const next = waiting.pop();
        if (found.has(next)) continue;
        found.add(next);
        waiting.push(...imports(next));
    }
    return found;
}

test('no module imports one that imports it', () => {
    assert.ok(modules.size > 15);
    for (const name of modules.keys())
        assert.ok(!reached(name).has(name), `${name} reaches itself`);
});

test('every module is reached from app.js', () => {
    assert.deepEqual([...reached('app.js'), 'app.js'].sort(), [...modules.keys()].sort());
});

test('every view is a class with end()', () => {
    const views = [...modules.get('app.js').matchAll(/import\('\.\/([\w.]+)'\)/g)];
    assert.equal(views.length, 7);
    for (const [, name] of views) {
        const classes = modules.get(name).match(/^export class View \{$/gm) ?? [];
        assert.equal(classes.length, 1, `${name} exports one class View`);
        assert.match(modules.get(name), /^ {4}end\(\) \{/m, `${name}: a view has end()`);
    }
});

test('lines have 100 columns at most', () => {
    for (const [name, source] of modules)
        source.split('\n').forEach(
            (line, i) => assert.ok([...line].length <= 100, `${name}:${i + 1} is longer`));
});
