// SPDX-License-Identifier: MIT
//! Brings every slave of the line to OP with the process data that it has, and prints a line for each: its state and its name.
use std::time::{Duration, Instant};

use ethercrab::error::Error;
use ethercrab::std::ethercat_now;
use ethercrab::MainDevice;

const LIMIT: Duration = Duration::from_secs(20);

pub async fn to_op(master: &MainDevice<'static>) -> Result<(), Error> {
    let group = master.init_single_group::<64, 4096>(ethercat_now).await?;
    let group = group.into_safe_op(master).await?.request_into_op(master).await?;
    let end = Instant::now() + LIMIT;
    while !group.tx_rx(master).await?.all_op() && Instant::now() < end {
        smol::Timer::after(Duration::from_millis(1)).await;
    }
    for slave in group.iter(master) {
        let (state, code) = slave.status().await?;
        println!("{state:?}\t{code:?}\t{}", slave.name());
    }
    Ok(())
}
