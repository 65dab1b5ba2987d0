hal check ini-version-missing.ini
