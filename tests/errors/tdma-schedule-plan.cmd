# packages: tdma
hal tdma plan tdma-schedule.tdma
