hal check --ini substitution-too-long.ini substitution-too-long.hal
