hal sim no-transaction.hal
