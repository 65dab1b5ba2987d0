hal check --ini unset-ini-key.ini unset-ini-key.hal
