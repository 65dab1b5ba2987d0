hal check ini-version.ini
