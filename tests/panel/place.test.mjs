// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {changed, enter, isShown, parse} from '../../tools/panel/page/place.js';

const views = ['overview', 'graph', 'scope'];

test('the hash names a view and its state', () => {
    const {name, query} = parse('#/scope?ch=a.out,b.out&base=0.5', views);
    assert.equal(name, 'scope');
    assert.deepEqual([...query], [['ch', 'a.out,b.out'], ['base', '0.5']]);
});

test('an unknown or missing view is the first one', () => {
    for (const hash of ['', '#', '#/', '#/nowhere', '#/scope/x', 'scope'])
        assert.equal(parse(hash, views).name, 'overview', hash);
});

test('changed state keeps the view and the other keys, and drops empty values', () => {
    assert.equal(
        changed('#/graph?filter=pid&by=file', {filter: 'x y'}), '#/graph?filter=x+y&by=file');
    assert.equal(changed('#/graph?filter=pid', {filter: ''}), '#/graph');
    assert.equal(changed('#/graph', {level: 0, by: null, around: undefined}), '#/graph?level=0');
});

test('what was entered is shown until something else is', () => {
    enter('#/graph');
    assert.ok(isShown('#/graph'));
    enter('#/scope');
    assert.ok(!isShown('#/graph'));
});
