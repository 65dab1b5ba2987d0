hal check --ini wrong-arguments-ini.ini wrong-arguments-ini.hal
