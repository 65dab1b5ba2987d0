// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {
    concerns,
    FaultTrigger,
    faultSource,
    isFaultSource,
    nameOfFaults
} from '../../tools/panel/page/scope_fault_trigger.js';

test('a source of faults keeps the name', () => {
    assert.ok(isFaultSource(faultSource('')) && isFaultSource(faultSource('axis.0')));
    assert.ok(!isFaultSource('fault') && !isFaultSource(''));
    assert.equal(nameOfFaults(faultSource('axis.0')), 'axis.0');
});

// The sentences of runtime/machine/report/fault_log.cpp.
const ofInstance = 'canopen.0: node 3: no heartbeat at cycle 70; see: show pin canopen.0';
const ofPin = "servo: pin 'pid.1.output' (pid) became nan at cycle 7; it was set to 0; " +
    'see: show pin pid.1';
const ofFunction = "servo: function 'wave.update' (siggen) threw an exception at cycle 7; stopped";

test('a fault concerns the instance that it names', () => {
    assert.ok(concerns(ofInstance, 'canopen.0') && !concerns(ofInstance, 'canopen.1'));
    assert.ok(concerns(ofPin, 'pid.1') && concerns(ofPin, 'servo'));
    assert.ok(!concerns(ofPin, 'pid') && !concerns(ofPin, 'pid.10'));
    assert.ok(concerns(ofFunction, 'wave') && !concerns(ofFunction, 'wav'));
    assert.ok([ofInstance, ofPin, ofFunction].every(text => concerns(text, '')));
});

test('a fault is found once, and none from before the trigger was armed', () => {
    const faults = [{at: 1, text: ofPin}];
    const any = new FaultTrigger('', () => faults), one = new FaultTrigger('wave', () => faults);
    assert.deepEqual(any.scan(), []);
    faults.push({at: 3, text: ofFunction}, {at: 2, text: ofPin});
    assert.deepEqual(any.scan(), [2, 3]);
    assert.deepEqual(any.scan(), []);
    assert.deepEqual(one.scan(), [3]);
});
