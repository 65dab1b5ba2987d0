# packages: ethercat
hal ethercat check ethercat-value.ethercat
