// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import test from 'node:test';

import {fitted} from '../../tools/panel/page/scope_labels.js';

/** A context in which each character is 10 wide. */
const context = {font: '', measureText: text => ({width: 10 * text.length})};

test('A_text_that_fits_stays_whole', () => {
    assert.equal(fitted(context, 'fault: late', 110), 'fault: late');
});

test('A_text_that_is_too_wide_ends_with_an_ellipsis', () => {
    assert.equal(fitted(context, 'fault: late', 100), 'fault: la…');
    assert.equal(fitted(context, 'fault: late', 5), '…');
});
