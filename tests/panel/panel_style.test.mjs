// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {applyStyle, cellStyle, packStyle} from '../../tools/panel/page/panel_style.js';

const element = () => ({style: {}});

test('the sides of a cell that sticks', () => {
    const expected = [
        ['nsew', 'stretch', 'stretch'], ['ne', 'end', 'start'], ['sw', 'start', 'end'],
        ['', 'center', 'center']
    ];
    for (const [sticky, across, along] of expected) {
        const one = element();
        cellStyle(one, 1, 2, 1, 3, sticky);
        assert.equal(one.style.gridArea, '1 / 2 / span 1 / span 3');
        assert.deepEqual([one.style.justifySelf, one.style.alignSelf], [across, along], sticky);
    }
});

test('fill and anchor in a box', () => {
    const filled = element(), anchored = element();
    packStyle(filled, {fill: 'both', expand: true}, true);
    assert.deepEqual(filled.style, {flexGrow: 1, alignSelf: 'stretch'});
    packStyle(anchored, {anchor: 'n'}, true);
    assert.equal(anchored.style.alignSelf, 'flex-start');
});

test('fonts and colours of Tk', () => {
    const one = element();
    applyStyle(one, {bg: 'red', font: ['Helvetica', '20', 'bold'], relief: 'SUNKEN'}, 'label');
    assert.equal(one.style.background, 'red');
    assert.equal(one.style.color, '#000');
    assert.equal(one.style.fontFamily, '"Helvetica", sans-serif');
    assert.equal(one.style.fontSize, '20pt');
    assert.equal(one.style.fontWeight, 'bold');
    assert.equal(one.style.border, '2px inset');
});

test('a font whose name is none is the default', () => {
    for (const family of ['a"b', 'a;b', '{}']) {
        const one = element();
        applyStyle(one, {font: [family, '-12']}, 'label');
        assert.equal(one.style.fontFamily, 'sans-serif');
        assert.equal(one.style.fontSize, '12px');
    }
});
