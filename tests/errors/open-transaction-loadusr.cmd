hal sim open-transaction-loadusr.hal
