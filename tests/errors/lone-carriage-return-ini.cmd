hal check --ini lone-carriage-return-ini.ini lone-carriage-return-ini.hal
