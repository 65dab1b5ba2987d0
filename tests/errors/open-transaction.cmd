hal sim open-transaction.hal
