hal check --ini bad-ini-line.ini bad-ini-line.hal
