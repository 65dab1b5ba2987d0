# packages: ethercat
hal ethercat plan ethercat-line.ethercat
