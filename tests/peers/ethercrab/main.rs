// SPDX-License-Identifier: MIT
//! A master on the interface of the first argument, for three emulated slaves: a servo drive, 8 outputs, 8 inputs. Prints a line for each thing that
//! it checks, "ok NAME" or "FAIL NAME SEEN". ethercat_ethercrab_test.py starts it. With the second argument `to-op`, for any slaves: `to_op.rs`.
mod to_op;

use std::time::{Duration, Instant};

use ethercrab::std::{ethercat_now, tx_rx_task};
use ethercrab::subdevice_group::DcConfiguration;
use ethercrab::{DcSync, MainDevice, MainDeviceConfig, PduStorage, Timeouts};

const CYCLE: Duration = Duration::from_millis(2);
static FRAMES: PduStorage<16, { PduStorage::element_size(1100) }> = PduStorage::new();

fn check(name: &str, holds: bool, seen: impl std::fmt::Debug) {
    if holds {
        println!("ok   {name}");
    } else {
        println!("FAIL {name} {seen:?}");
    }
}

fn main() {
    let interface = std::env::args().nth(1).expect("the interface is missing");
    let (sender, receiver, frames) = FRAMES.try_split().expect("frames");
    let timeouts = Timeouts {
        // those of the crate are for a machine that does nothing else
        pdu: Duration::from_millis(500),
        eeprom: Duration::from_secs(1),
        mailbox_echo: Duration::from_secs(1),
        mailbox_response: Duration::from_secs(5),
        state_transition: Duration::from_secs(10),
        ..Timeouts::default()
    };
    let master = MainDevice::new(frames, timeouts, MainDeviceConfig { dc_static_sync_iterations: 500, ..MainDeviceConfig::default() });
    smol::spawn(tx_rx_task(&interface, sender, receiver).expect("the interface cannot be opened")).detach();
    let only_states = std::env::args().nth(2).as_deref() == Some("to-op");
    let result = if only_states { smol::block_on(to_op::to_op(&master)) } else { smol::block_on(work(&master)) };
    if let Err(problem) = result {
        eprintln!("EtherCAT: {problem:?}");
        std::process::exit(1);
    }
}

async fn work(master: &MainDevice<'static>) -> Result<(), ethercrab::error::Error> {
    let mut group = master.init_single_group::<8, 128>(ethercat_now).await?;
    let names: Vec<String> = group.iter(master).map(|s| s.name().to_string()).collect();
    check("names", names == ["servo", "digital_out", "digital_in"], &names);
    for mut slave in group.iter_mut(master) {
        if slave.name() != "servo" {
            continue;
        }
        let vendor = slave.sdo_read::<u32>(0x1018, 1).await?;
        check("vendor of 1018h", vendor == 0xffffff, vendor);
        slave.sdo_write(0x6060, 0, 9u8).await?;
        let mode = slave.sdo_read::<u8>(0x6060, 0).await?;
        check("a value is read back", mode == 9, mode);
        check("an object that does not exist", slave.sdo_read::<u32>(0x2fff, 0).await.is_err(), ());
        // controlword and target velocity only
        slave.sdo_write(0x1c12, 0, 0u8).await?;
        slave.sdo_write(0x1600, 0, 0u8).await?;
        slave.sdo_write(0x1600, 1, 0x6040_0010u32).await?;
        slave.sdo_write(0x1600, 2, 0x60ff_0020u32).await?;
        slave.sdo_write(0x1600, 0, 2u8).await?;
        slave.sdo_write(0x1c12, 1, 0x1600u16).await?;
        slave.sdo_write(0x1c12, 0, 1u8).await?;
        slave.set_dc_sync(DcSync::Sync0);
    }
    let group = group.into_pre_op_pdi(master).await?;
    for _ in 0..500 {
        group.tx_rx_sync_system_time(master).await?;
        smol::Timer::after(Duration::from_millis(1)).await;
    }
    let clocks = DcConfiguration { start_delay: Duration::from_millis(50), sync0_period: CYCLE, sync0_shift: CYCLE / 2 };
    let group = group.configure_dc_sync(master, clocks).await?.into_safe_op(master).await?;
    let servo = group.subdevice(master, 0)?;
    let outputs = servo.outputs_raw_mut().len(); // two statements: each holds the lock of the process data until its end
    let inputs = servo.inputs_raw().len();
    check("sizes of the process data", (outputs, inputs) == (6, 13), (outputs, inputs));
    group.subdevice(master, 1)?.outputs_raw_mut()[0] = 0xa5;

    let group = group.request_into_op(master).await?;
    let mut all_op = false;
    let end = Instant::now() + Duration::from_secs(20);
    while !all_op && Instant::now() < end {
        let begin = Instant::now();
        let answer = group.tx_rx_dc(master).await?;
        all_op = answer.all_op();
        smol::Timer::at(begin + answer.extra.next_cycle_wait).await;
    }
    check("OP with distributed clocks", all_op, ());

    let servo = group.subdevice(master, 0)?;
    for (name, control, status) in [("ready to switch on", 6u16, 0x21u16), ("switched on", 7, 0x23), ("operation enabled", 15, 0x27)] {
        let mut seen = 0;
        for _ in 0..2000 {
            {
                let mut out = servo.outputs_raw_mut();
                out[..2].copy_from_slice(&control.to_le_bytes());
                out[2..6].copy_from_slice(&20_000i32.to_le_bytes());
            }
            let begin = Instant::now();
            let answer = group.tx_rx_dc(master).await?;
            smol::Timer::at(begin + answer.extra.next_cycle_wait).await;
            let inputs = servo.inputs_raw();
            seen = u16::from_le_bytes([inputs[0], inputs[1]]) & 0x6f;
            if seen == status {
                break;
            }
        }
        check(name, seen == status, seen);
    }
    let position = || {
        let inputs = servo.inputs_raw();
        i32::from_le_bytes([inputs[3], inputs[4], inputs[5], inputs[6]])
    };
    let began = position();
    let mut wrong_counters = 0;
    for _ in 0..1000 {
        let begin = Instant::now();
        let answer = group.tx_rx_dc(master).await?;
        wrong_counters += u32::from(answer.working_counter != 6);
        smol::Timer::at(begin + answer.extra.next_cycle_wait).await;
    }
    check("the drive turns", position() - began > 1000, position() - began);
    check("working counter", wrong_counters == 0, wrong_counters);
    Ok(())
}
