// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {Store} from '../../tools/panel/page/scope_data.js';
import {Picture} from '../../tools/panel/page/scope_picture.js';

globalThis.ImageData = class {
    constructor(width, height) {
        Object.assign(this, {width, height, data: new Uint8ClampedArray(4 * width * height)});
    }
};

const width = 48, height = 20, back = 1, line = 2, grid = 3;

function picture() {
    const one = new Picture();
    one.colours = new Map(Object.entries({back, line, grid}));
    return one;
}

const columnsWith = (one, paint) => Array.from({length: width}, (_, x) => x).filter(
    x => Array.from({length: height}, (_, y) => one.pixels[y * width + x]).includes(paint));

test('the ground is drawn again only when its key is another one', () => {
    const one = picture();
    let drawn = 0;
    const ground = () => {
        drawn++;
        one.vertical(5, 'grid');
    };
    for (const key of ['', '', 'stop', 'stop', '']) {
        one.begin(width, height, 1, 'back', key, ground);
        assert.deepEqual(columnsWith(one, grid), [5]);
        one.vertical(9, 'line');  // what is drawn on the ground is gone in the next picture
    }
    assert.equal(drawn, 3);
    one.begin(width, height, 2, 'back', '', ground);
    assert.deepEqual(columnsWith(one, grid), [5, 6]);
});

test('a dashed trace has gaps where each column has a step', () => {
    const store = new Store(), one = picture();
    store.layout([{columns: [0]}], ['out']);
    for (let i = 0; i < width; i++)
        store.values({time_ns: i * 1e6, values: [i % 2], skipped: 0});
    one.begin(width, height, 1, 'back', '', () => {});
    one.trace(store, 'out', 0, width / 1000, 15, 10, {name: 'line', thick: 1, dashed: true});
    const gaps = Array.from({length: width}, (_, x) => x).filter(x => x % 12 >= 8);
    assert.deepEqual(columnsWith(one, line).filter(x => gaps.includes(x)), []);
    assert.ok(columnsWith(one, line).length >= width - gaps.length - 1);
});
