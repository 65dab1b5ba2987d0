// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {Store} from '../../tools/panel/page/scope_data.js';
import {Picture} from '../../tools/panel/page/scope_picture.js';
import {Roll} from '../../tools/panel/page/scope_roll.js';

globalThis.ImageData = class {
    constructor(width, height) {
        Object.assign(this, {width, height, data: new Uint8ClampedArray(4 * width * height)});
    }
};

const width = 60, height = 30, each = .004, names = ['a', 'b'];
const colours = {back: 1, grid: 2, dim: 3, a: 4, b: 5};
const rows = new Uint32Array(height).fill(colours.back);
rows.fill(colours.grid, 10, 11).fill(colours.dim, 20, 21);
const isLine = new Uint8Array(height).fill(1, 20, 21);
const back = {key: 'back', rows, isLine};

/// A picture with a vertical line of the grid, on which nothing is drawn yet.
function begun() {
    const one = new Picture();
    one.colours = new Map(Object.entries(colours));
    one.begin(width, height, 1, 'back', '', () => {
        one.vertical(30, 'grid');
        one.horizontal(10, 'grid');
    });
    return one;
}

function random() {
    let seed = 7;
    return limit => {
        seed = (seed * 48271) % 2147483647;
        return seed % limit;
    };
}

/// A store of two channels in two threads. add(count, skipped): that many rows of both, one in a
/// millisecond, after some milliseconds without rows.
function recorded() {
    const store = new Store(), next = random();
    store.layout([{columns: [0]}, {columns: [1]}], names);
    let ms = 0;
    const add = (count, skipped = 0) => {
        ms += skipped;
        for (let i = 0; i < count; i++, ms++)
            store.groups.forEach((group, k) => {
                if (k === 1 && ms % 2 === 1) return;
                group.values[0][group.add(store.seconds(ms * 1e6))] = next(21) - 10;
            });
        store.newest = ms / 1000;
    };
    return {store, add};
}

const tracesOf = (store, thick) => names.map((name, i) => ({
    columns: store.columns(name, each),
    zero: 15,
    perUnit: 1.2,
    line: {name, thick, dashed: i === 1}
}));

/// The pixels after the newest sample was put by this roll, or by one that begins.
function pixelsOf(store, roll = new Roll(), thick = 1) {
    const one = begun(), first = Math.floor((store.newest - width * each) / each);
    roll.put(one, tracesOf(store, thick), first, back);
    return [...one.pixels];
}

test('moved traces are those that are drawn as a whole', () => {
    const {store, add} = recorded(), roll = new Roll(), next = random();
    add(600);
    pixelsOf(store, roll);
    assert.equal(roll.drawn, width);
    for (let i = 0; i < 100; i++) {
        add(1 + next(60), i % 9 === 0 ? next(40) : 0);
        assert.deepEqual(pixelsOf(store, roll), pixelsOf(store));
        assert.ok(roll.drawn < width / 2 + 2, `${roll.drawn} columns`);
    }
});

test('without new samples nothing but the last columns is drawn', () => {
    const {store, add} = recorded(), roll = new Roll();
    add(600);
    const before = pixelsOf(store, roll);
    assert.deepEqual(pixelsOf(store, roll), before);
    assert.ok(roll.drawn <= 2);
});

test('what changes the traces draws all of them', () => {
    const {store, add} = recorded(), roll = new Roll();
    add(600);
    pixelsOf(store, roll);
    assert.deepEqual(pixelsOf(store, roll, 2), pixelsOf(store, new Roll(), 2));
    assert.equal(roll.drawn, width);
    roll.forget();
    pixelsOf(store, roll, 2);
    assert.equal(roll.drawn, width);
    add(10000);  // more than a picture
    assert.deepEqual(pixelsOf(store, roll, 2), pixelsOf(store, new Roll(), 2));
    store.layout([{columns: [0]}, {columns: [1]}], names);  // the machine was started again
    store.groups.forEach(group => {
        for (let i = 0; i < 600; i++)
            group.values[0][group.add(store.seconds(i * 1e6))] = 3;
    });
    assert.deepEqual(pixelsOf(store, roll, 2), pixelsOf(store, new Roll(), 2));
});

test('the grid is behind the traces and stays where it is; the zero line runs through', () => {
    const {store, add} = recorded(), roll = new Roll();
    add(600);
    pixelsOf(store, roll);
    add(13);
    const pixels = pixelsOf(store, roll), column = x => pixels.filter((_, i) => i % width === x);
    assert.ok(column(30).includes(colours.grid));
    assert.ok(column(30).includes(colours.a));
    assert.equal(column(29).filter(one => one === colours.grid).length <= 1, true);
    const line = pixels.slice(20 * width, 21 * width);
    assert.deepEqual(line.filter(one => one === colours.grid || one === colours.back), []);
});
